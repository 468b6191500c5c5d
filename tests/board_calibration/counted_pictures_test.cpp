// A picture counts if the board in it is sharp and held as in no picture before.
#include "calibration/boards/counted_pictures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/board_calibration/generated_boards.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kSeed = 1;

cv::Mat held_picture(const BoardTarget& target, const Transform& cMt) {
  return picture_of(true_camera(), cMt, checkerboard_print(target));
}

cv::Mat blurred(const cv::Mat& picture, double sigma) {
  cv::Mat out;
  cv::GaussianBlur(picture, out, {}, sigma);
  return out;
}

TEST(CountedPictures, ABlurredBoardIsFoundButNotClear) {
  const BoardTarget target = checkerboard();
  const cv::Mat sharp = held_picture(target, held(target, {0, 0, 0.5}, {0.3, -0.35, 0.1})), soft = blurred(sharp, 4);
  ASSERT_TRUE(find_board(soft, target).board);
  EXPECT_THAT(find_clear_board(soft, target).refused, HasSubstr("not sharp"));
  const BoardSearch clear = find_clear_board(sharp, target);
  ASSERT_TRUE(clear.board) << clear.refused;
  EXPECT_LT(edge_width_px(sharp, *clear.board), 3);
  EXPECT_EQ(find_clear_board(cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)), target).refused,
            "found no checkerboard, expected 9 x 6 corners");
}

TEST(CountedPictures, NoiseIsNoBlurAndBlurUnderNoiseIsSeen) {
  RecordProperty("seed", std::to_string(kSeed));
  const BoardTarget target = checkerboard();
  const cv::Mat sharp = held_picture(target, held(target, {0, 0, 0.5}, {0.3, -0.35, 0.1}));
  cv::RNG random(kSeed);
  cv::Mat noise(sharp.size(), CV_16SC1);
  random.fill(noise, cv::RNG::NORMAL, 0, 5);
  const auto noisy = [&](const cv::Mat& picture) {
    cv::Mat out;
    cv::add(picture, noise, out, {}, CV_8U);
    return out;
  };
  EXPECT_TRUE(find_clear_board(noisy(sharp), target).board);
  EXPECT_FALSE(find_clear_board(noisy(blurred(sharp, 4)), target).board);
}

TEST(CountedPictures, ABoardHeldAlikeDoesNotCountTwiceButAShiftedOrATiltedOneDoes) {
  RecordProperty("seed", std::to_string(kSeed));
  const BoardTarget target = checkerboard();
  std::mt19937_64 random(kSeed);
  CountedPictures pictures(640, 480);
  const auto add = [&](const Vector3d& place, const Vector3d& turn) {
    return pictures.add(corners_of(true_camera(), target, held(target, place, turn), 0.2, random));
  };
  EXPECT_EQ(add({0, 0, 0.5}, {0, 0, 0}), "");
  const double at_first = pictures.covered();
  EXPECT_THAT(add({0, 0, 0.5}, {0, 0, 0}), HasSubstr("held as in a picture before"));
  EXPECT_THAT(add({0.003, 0, 0.5}, {0, 0, 0}), HasSubstr("held as in a picture before"));
  EXPECT_EQ(pictures.count(), 1U);
  EXPECT_EQ(add({0.05, 0.03, 0.5}, {0, 0, 0}), "");
  EXPECT_GT(pictures.covered(), at_first);
  EXPECT_EQ(add({0, 0, 0.5}, {0.5, 0, 0}), "");
  EXPECT_EQ(add({0, 0, 0.8}, {0, 0, 0}), "");
  EXPECT_EQ(pictures.count(), 4U);
}

TEST(CountedPictures, PicturesOfDifferentPartsOfABoardCountBoth) {
  std::mt19937_64 random(kSeed);
  const BoardTarget target = checkerboard();
  FoundBoard all = corners_of(true_camera(), target, held(target, {0, 0, 0.5}, {0, 0, 0}), 0, random), first = all,
             last = all;
  first.ids.resize(27), first.pixels.resize(27);
  last.ids.erase(last.ids.begin(), last.ids.begin() + 27),
      last.pixels.erase(last.pixels.begin(), last.pixels.begin() + 27);
  CountedPictures pictures(640, 480);
  EXPECT_EQ(pictures.add(first), "");
  EXPECT_EQ(pictures.add(last), "");
  EXPECT_THAT(pictures.add(all), HasSubstr("held as in a picture before"));
}

}  // namespace
}  // namespace tankrig
