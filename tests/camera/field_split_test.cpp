// Fields against rows worked out by hand.
#include "drivers/camera/field_split.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tankrig {
namespace {

/// One pixel wide: the value of each row.
cv::Mat rows(const std::vector<int>& values) {
  cv::Mat picture(static_cast<int>(values.size()), 1, CV_8UC1);
  for (int y = 0; y < picture.rows; ++y)
    picture.at<std::uint8_t>(y, 0) = static_cast<std::uint8_t>(values[static_cast<std::size_t>(y)]);
  return picture;
}

std::vector<int> values(const cv::Mat& picture) {
  std::vector<int> out;
  for (int y = 0; y < picture.rows; ++y) out.push_back(picture.at<std::uint8_t>(y, 0));
  return out;
}

using V = std::vector<int>;

TEST(FieldSplit, RowsInPlaceBelongToTopAndBottomInTurn) {
  const cv::Mat picture = rows({0, 10, 20, 30, 40, 50});
  for (FieldLayout layout : {FieldLayout::kInterlacedTopFirst, FieldLayout::kInterlacedBottomFirst}) {
    EXPECT_EQ(values(field_lines(picture, layout, Parity::kTop)), (V{0, 20, 40}));
    EXPECT_EQ(values(field_lines(picture, layout, Parity::kBottom)), (V{10, 30, 50}));
  }
}

TEST(FieldSplit, SequentialFieldsLieOneAfterTheOther) {
  const cv::Mat picture = rows({0, 20, 40, 10, 30, 50});
  EXPECT_EQ(values(field_lines(picture, FieldLayout::kSequentialTopFirst, Parity::kTop)), (V{0, 20, 40}));
  EXPECT_EQ(values(field_lines(picture, FieldLayout::kSequentialTopFirst, Parity::kBottom)), (V{10, 30, 50}));
  EXPECT_EQ(values(field_lines(picture, FieldLayout::kSequentialBottomFirst, Parity::kBottom)), (V{0, 20, 40}));
  EXPECT_EQ(values(field_lines(picture, FieldLayout::kSequentialBottomFirst, Parity::kTop)), (V{10, 30, 50}));
}

TEST(FieldSplit, TheLayoutSaysWhichFieldIsOlder) {
  EXPECT_EQ(first_field(FieldLayout::kInterlacedTopFirst), Parity::kTop);
  EXPECT_EQ(first_field(FieldLayout::kInterlacedBottomFirst), Parity::kBottom);
  EXPECT_EQ(first_field(FieldLayout::kSequentialTopFirst), Parity::kTop);
  EXPECT_EQ(first_field(FieldLayout::kSequentialBottomFirst), Parity::kBottom);
  EXPECT_EQ(first_field(FieldLayout::kTop), Parity::kTop);
  EXPECT_EQ(first_field(FieldLayout::kBottom), Parity::kBottom);
}

TEST(FieldSplit, AFieldAtFullHeightKeepsItsOwnRowsWhereTheyAre) {
  EXPECT_EQ(values(full_height(rows({0, 20, 40}), Parity::kTop)), (V{0, 10, 20, 30, 40, 40}));
  EXPECT_EQ(values(full_height(rows({10, 30, 50}), Parity::kBottom)), (V{10, 10, 20, 30, 40, 50}));
}

TEST(FieldSplit, EitherFieldOfARampIsTheRampAgainSoTheCameraModelHolds) {
  V ramp;
  for (int y = 0; y < 32; ++y) ramp.push_back(3 * y);
  const cv::Mat picture = rows(ramp);
  for (Parity parity : {Parity::kTop, Parity::kBottom}) {
    const V got = values(full_height(field_lines(picture, FieldLayout::kInterlacedTopFirst, parity), parity));
    for (std::size_t y = 1; y + 1 < got.size(); ++y) EXPECT_NEAR(got[y], ramp[y], 0.5) << "row " << y;
  }
}

TEST(FieldSplit, AHorizontalLineStaysAtItsHeightInEitherField) {
  // A bright bar on rows 12..15, its centre between 13 and 14.
  cv::Mat picture(32, 5, CV_8UC3, cv::Scalar::all(0));
  picture.rowRange(12, 16).setTo(cv::Scalar::all(200));
  for (Parity parity : {Parity::kTop, Parity::kBottom}) {
    const cv::Mat field = full_height(field_lines(picture, FieldLayout::kInterlacedTopFirst, parity), parity);
    double sum = 0, weighted = 0;
    for (int y = 0; y < 32; ++y) {
      sum += field.at<cv::Vec3b>(y, 2)[1];
      weighted += y * field.at<cv::Vec3b>(y, 2)[1];
    }
    EXPECT_NEAR(weighted / sum, 13.5, 0.51);
    EXPECT_NEAR(weighted / sum, parity == Parity::kTop ? 13.0 : 14.0, 1e-9) << "its own rows 12 and 14, or 13 and 15";
  }
}

TEST(FieldSplit, WovenFieldsAreTheOldPicture) {
  const cv::Mat picture = rows({0, 10, 20, 30, 40, 50});
  const auto layout = FieldLayout::kInterlacedTopFirst;
  EXPECT_EQ(values(woven(field_lines(picture, layout, Parity::kTop), field_lines(picture, layout, Parity::kBottom))),
            values(picture));
}

TEST(FieldSplit, FieldsOfTwoRowsWork) {
  EXPECT_EQ(values(full_height(rows({7}), Parity::kTop)), (V{7, 7}));
  EXPECT_EQ(values(full_height(rows({7}), Parity::kBottom)), (V{7, 7}));
}

}  // namespace
}  // namespace tankrig
