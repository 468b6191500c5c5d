// Targets are found in pictures of a known camera, and what is no such target is refused by name.
#include "calibration/boards/find_board.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>

#include "core/input_error.hpp"
#include "tests/board_calibration/generated_boards.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

Transform tilted(const BoardTarget& target) { return held(target, {0.01, -0.01, 0.5}, {0.3, -0.35, 0.1}); }

/// Root mean square distance of the corners found from where they are.
double miss(const FoundBoard& board, const CameraModel& camera, const BoardTarget& target, const Transform& cMt) {
  const std::vector<Vector3d> points = target.points();
  double sum = 0;
  for (std::size_t i = 0; i < board.ids.size(); ++i)
    sum += (camera.project(cMt * points[std::size_t(board.ids[i])]).value() - board.pixels[i]).squaredNorm();
  return std::sqrt(sum / double(board.ids.size()));
}

cv::Mat turned_half(const cv::Mat& picture) {
  cv::Mat turned;
  cv::rotate(picture, turned, cv::ROTATE_180);
  return turned;
}

TEST(FindBoard, FindsEveryCornerOfACheckerboard) {
  const BoardTarget target = checkerboard();
  const Transform cMt = tilted(target);
  const BoardSearch search = find_board(picture_of(true_camera(), cMt, checkerboard_print(target)), target);
  ASSERT_TRUE(search.board) << search.refused;
  EXPECT_EQ(search.board->ids.size(), 54u);
  EXPECT_LT(miss(*search.board, true_camera(), target, cMt), 0.06);
}

TEST(FindBoard, AnUpsideDownCheckerboardIsNumberedAsIfItWereUpright) {
  const BoardTarget target = checkerboard();
  const Transform cMt = tilted(target);
  const cv::Mat picture = picture_of(true_camera(), cMt, checkerboard_print(target));
  const BoardSearch upright = find_board(picture, target), turned = find_board(turned_half(picture), target);
  ASSERT_TRUE(upright.board && turned.board);
  for (std::size_t i = 0; i < upright.board->pixels.size(); ++i)
    ASSERT_LT((upright.board->pixels[i] + turned.board->pixels[i] - Vector2d(639, 479)).norm(), 0.05) << i;
}

TEST(FindBoard, NamesAHalfSeenABiggerASmallerAndNoCheckerboard) {
  const BoardTarget target = checkerboard();
  const cv::Mat picture = picture_of(true_camera(), tilted(target), checkerboard_print(target));
  const auto refusal = [](const cv::Mat& p, const char* pattern) {
    return find_board(p, checkerboard(pattern)).refused;
  };
  EXPECT_THAT(refusal(picture(cv::Rect(0, 0, 360, 480)).clone(), "9x6"), HasSubstr("found a part of a board, "));
  EXPECT_THAT(refusal(picture, "8x5"), HasSubstr("expected 8 x 5 corners"));
  EXPECT_THAT(refusal(picture, "9x5"), HasSubstr("found a board of 9 x 6 corners, expected 9 x 5 corners"));
  EXPECT_EQ(refusal(picture, "10x7"), "found a board of 9 x 6 corners, expected 10 x 7 corners");
  EXPECT_EQ(refusal(cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)), "9x6"),
            "found no checkerboard, expected 9 x 6 corners");
}

TEST(FindBoard, RefusesSquaresOfAFewPixels) {
  const BoardTarget target = board_target(TargetKind::kCheckerboard, "9x6", 0.0055);
  const Transform cMt = held(target, {0, 0, 0.45}, {0, 0.1, 0});
  EXPECT_THAT(find_board(picture_of(true_camera(), cMt, checkerboard_print(target)), target).refused,
              HasSubstr("expected"));
}

TEST(FindBoard, FindsDotsInBothArrangements) {
  for (const auto& [kind, pattern, spacing] :
       {std::tuple{TargetKind::kDots, "7x5", 0.035}, {TargetKind::kAsymmetricDots, "4x11", 0.016}}) {
    const BoardTarget target = board_target(kind, pattern, spacing);
    const Transform cMt = held(target, {0.01, 0, 0.5}, {0.2, -0.2, 0.1});
    const BoardSearch search = find_board(picture_of(true_camera(), cMt, dots_print(target)), target);
    ASSERT_TRUE(search.board) << name_of(kind) << ": " << search.refused;
    // A symmetric grid does not tell which way round it is.
    double least = 1e9;
    for (const std::vector<int>& turn : target.turns()) {
      FoundBoard board = *search.board;
      for (int& id : board.ids) id = turn[std::size_t(id)];
      least = std::min(least, miss(board, true_camera(), target, cMt));
    }
    EXPECT_LT(least, 0.35) << name_of(kind);
  }
}

TEST(FindBoard, NamesDotsOfAnotherGrid) {
  const BoardTarget target = board_target(TargetKind::kDots, "7x5", 0.035);
  const cv::Mat picture = picture_of(true_camera(), held(target, {0.01, 0, 0.5}, {0.2, -0.2, 0.1}), dots_print(target));
  EXPECT_THAT(find_board(picture, board_target(TargetKind::kDots, "8x5", 0.035)).refused,
              HasSubstr("found 35 dots in no such grid, expected 8 x 5 dots"));
  EXPECT_THAT(find_board(picture, board_target(TargetKind::kDots, "7x4", 0.035)).refused,
              HasSubstr("expected 7 x 4 dots"));
}

class CharucoTest : public testing::Test {
 protected:
  CharucoTest() {
    const auto board = cv::aruco::CharucoBoard::create(8, 7, 0.04F, 0.03F, cv::aruco::getPredefinedDictionary(0));
    board->draw({800, 700}, sheet_, 0, 1);
  }
  /// The sheet's first inner corner is the target's origin.
  Print print() const {
    return [this](double x, double y) {
      const int u = int(std::floor((x / 0.04 + 1) * 100)), v = int(std::floor((y / 0.04 + 1) * 100));
      return u >= 0 && v >= 0 && u < sheet_.cols && v < sheet_.rows ? double(sheet_.at<uchar>(v, u)) : 255.0;
    };
  }
  BoardTarget target_ = board_target(TargetKind::kCharuco, "7x6", 0.04, 0.03);
  Transform cMt_ = held(target_, {0, 0, 0.5}, {0.25, -0.2, 0.1});
  cv::Mat sheet_;
};

TEST_F(CharucoTest, IsFoundWithTheNumbersOfItsCorners) {
  const BoardSearch search = find_board(picture_of(true_camera(), cMt_, print()), target_);
  ASSERT_TRUE(search.board) << search.refused;
  EXPECT_EQ(search.board->ids.size(), 42u);
  EXPECT_LT(miss(*search.board, true_camera(), target_, cMt_), 0.1);
}

TEST_F(CharucoTest, IsFoundHalfCovered) {
  cv::Mat picture = picture_of(true_camera(), cMt_, print());
  picture(cv::Rect(0, 0, 320, 480)).setTo(128);
  const BoardSearch search = find_board(picture, target_);
  ASSERT_TRUE(search.board) << search.refused;
  EXPECT_LT(search.board->ids.size(), 42u);
  EXPECT_LT(miss(*search.board, true_camera(), target_, cMt_), 0.1);
}

TEST_F(CharucoTest, InAMirrorOrOfAnotherSizeIsNamed) {
  const cv::Mat picture = picture_of(true_camera(), cMt_, print());
  cv::Mat mirrored;
  cv::flip(picture, mirrored, 1);
  EXPECT_THAT(find_board(mirrored, target_).refused, HasSubstr("the picture is mirrored"));
  EXPECT_THAT(find_board(picture, board_target(TargetKind::kCharuco, "5x4", 0.04, 0.03)).refused,
              HasSubstr("markers that a board of 5 x 4 corners does not have"));
  EXPECT_THAT(find_board(picture, board_target(TargetKind::kCharuco, "9x6", 0.04, 0.03)).refused,
              HasSubstr("do not lie as on a board of 9 x 6 corners"));
}

TEST(BoardTarget, NamesWhatCannotBe) {
  const auto error = [](TargetKind kind, const char* pattern, double spacing, double marker, const char* dictionary) {
    return message_of<InputError>([&] { board_target(kind, pattern, spacing, marker, dictionary); });
  };
  EXPECT_THAT(error(TargetKind::kCheckerboard, "9", 0.03, 0, ""),
              HasSubstr("pattern: found '9', expected COLUMNSxROWS"));
  EXPECT_THAT(error(TargetKind::kCheckerboard, "9x2", 0.03, 0, ""), HasSubstr("from 3 to 100"));
  EXPECT_THAT(error(TargetKind::kCheckerboard, "9x6", 30, 0, ""), HasSubstr("square: found 30000 mm"));
  EXPECT_THAT(error(TargetKind::kCharuco, "7x5", 0.03, 0.02, "4x4_50"),
              HasSubstr("6 rows of squares, expected an odd"));
  EXPECT_THAT(error(TargetKind::kCharuco, "7x6", 0.03, 0.03, "4x4_50"), HasSubstr("marker: found 30 mm"));
  EXPECT_THAT(error(TargetKind::kCharuco, "7x6", 0.03, 0.02, "9x9"), HasSubstr("dictionary: found '9x9'"));
}

}  // namespace
}  // namespace tankrig
