// Pictures that we write are read back by OpenCV's codecs, which are loaded from their module.
#include "core/picture_codecs.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/input_error.hpp"
#include "core/module.hpp"

namespace tankrig {
namespace {

constexpr int kUnchanged = -1;  // cv::IMREAD_UNCHANGED

/// Ramps of other slopes in each channel.
cv::Mat ramps(int type) {
  cv::Mat picture(48, 64, type);
  const int channels = picture.channels();
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      for (int c = 0; c < channels; ++c)
        picture.ptr(y)[x * channels + c] = static_cast<std::uint8_t>(2 * x + (1 + c) * y / 2);
  return picture;
}

TEST(PictureCodecs, ReadBackAPngBitForBit) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    const cv::Mat picture = ramps(type);
    const cv::Mat part = picture(cv::Rect(3, 5, 40, 30));  // rows apart in memory
    const cv::Mat back = decode_by_opencv(picture_png(part), kUnchanged);
    ASSERT_EQ(back.type(), type);
    ASSERT_EQ(back.size(), part.size());
    EXPECT_EQ(cv::norm(back, part, cv::NORM_INF), 0);
  }
}

TEST(PictureCodecs, ReadBackAJpegNearly) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    const cv::Mat picture = ramps(type);
    const cv::Mat back = decode_by_opencv(picture_jpeg(picture, 95), kUnchanged);
    ASSERT_EQ(back.type(), type);
    ASSERT_EQ(back.size(), picture.size());
    EXPECT_LT(cv::norm(back, picture, cv::NORM_INF), 12);
    EXPECT_LT(picture_jpeg(picture, 20).size(), picture_jpeg(picture, 95).size());
  }
}

TEST(PictureCodecs, RefuseWhatIsNoPictureOfEightBits) {
  for (const cv::Mat& other : {cv::Mat(), cv::Mat(4, 4, CV_16UC1), cv::Mat(4, 4, CV_8UC4)}) {
    EXPECT_THROW(picture_png(other), InputError);
    EXPECT_THROW(picture_jpeg(other, 90), InputError);
  }
}

TEST(PictureCodecs, GiveNothingForBytesThatAreNoPicture) {
  EXPECT_TRUE(decode_by_opencv("no picture", kUnchanged).empty());
  EXPECT_TRUE(decode_by_opencv("", kUnchanged).empty());
}

TEST(Module, ThatIsNotThereIsNamed) {
  try {
    module_symbol("tankrig_nothing.so", "nothing");
    FAIL() << "expected an InputError";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("lib/tankrig/tankrig_nothing.so"), std::string::npos) << error.what();
  }
  EXPECT_THROW(module_symbol("tankrig_codecs.so", "nothing"), InputError);
}

}  // namespace
}  // namespace tankrig
