// The size of a picture, read before it is decoded.
#include "session/reading/picture_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

std::string encoded(const char* ending, int type, const std::vector<int>& parameters = {}) {
  std::vector<unsigned char> bytes;
  cv::Mat noise(37, 300, type);
  cv::randu(noise, 0, 255);
  cv::imencode(ending, noise, bytes, parameters);
  return {bytes.begin(), bytes.end()};
}

TEST(PictureSize, IsThatOfTheDecodedPictureForEveryKindThatIsImported) {
  const std::string pictures[] = {encoded(".png", CV_8UC3),
                                  encoded(".png", CV_16UC1),
                                  encoded(".jpg", CV_8UC3),
                                  encoded(".jpg", CV_8UC1, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}),
                                  encoded(".bmp", CV_8UC3),
                                  encoded(".tif", CV_8UC3),
                                  encoded(".tif", CV_16UC1, {cv::IMWRITE_TIFF_COMPRESSION, 1}),
                                  encoded(".ppm", CV_8UC3),
                                  encoded(".pgm", CV_8UC1),
                                  encoded(".pgm", CV_8UC1, {cv::IMWRITE_PXM_BINARY, 0}),
                                  encoded(".pbm", CV_8UC1)};
  for (const std::string& picture : pictures) {
    EXPECT_EQ(picture_size(picture), cv::Size(300, 37)) << picture.substr(0, 4);
    EXPECT_EQ(decode_picture(picture, "p", nullptr, cv::IMREAD_ANYCOLOR).size(), cv::Size(300, 37));
    for (std::size_t bytes = 0; bytes < std::min<std::size_t>(picture.size(), 400); ++bytes)
      (void)picture_size(std::string_view(picture).substr(0, bytes));  // reads nothing beyond
  }
  EXPECT_EQ(picture_size("P5 # 9 9\n300\n# 5\n37 255\n"), cv::Size(300, 37));
}

TEST(PictureSize, OfATiffIsNotGuessedFromASideThatIsGivenTwiceOrAsAnOffset) {
  const std::string tiff = encoded(".tif", CV_8UC1);
  ASSERT_TRUE(tiff.starts_with("II"));
  const auto u16 = [&](std::size_t at) {
    return static_cast<unsigned char>(tiff[at]) + 256U * static_cast<unsigned char>(tiff[at + 1]);
  };
  const std::size_t directory = u16(4) + 65536U * u16(6), last = directory + 2 + 12 * (u16(directory) - 1U);
  std::size_t width = directory + 2;
  while (u16(width) != 256) width += 12;
  std::string twice = tiff, offset = tiff;
  twice.replace(last, 12, std::string("\0\1\3\0\1\0\0\0\2\0\0\0", 12));
  offset[width + 2] = 16;  // eight bytes, which lie where the entry says
  EXPECT_EQ(picture_size(tiff), cv::Size(300, 37));
  EXPECT_EQ(picture_size(twice), std::nullopt);
  EXPECT_EQ(picture_size(offset), std::nullopt);
}

TEST(DecodePicture, RefusesMoreThanWasExpectedOrAnyCameraHasBeforeItDecodes) {
  const std::string png =
      "\x89PNG\r\n\x1a\n" + std::string("\0\0\0\rIHDR\0\0\x75\x30\0\0\x75\x30", 16);  // 30000 x 30000, and nothing
  const auto refused = [&](const ExpectedSize* expected, std::string_view picture) {
    return message_of<InputError>([&] { decode_picture(picture, "a.png", expected, cv::IMREAD_ANYCOLOR); });
  };
  const ExpectedSize small{8, 6, "as calibrated"}, as_stated{30000, 30000, "as calibrated"};
  EXPECT_EQ(refused(&small, png), "a.png: found 30000 x 30000 px, expected 8 x 6 as calibrated");
  EXPECT_EQ(refused(nullptr, png), "a.png: found 30000 x 30000 px, expected at most 268 megapixels");
  EXPECT_EQ(refused(&as_stated, png), "a.png: found 30000 x 30000 px, expected at most 268 megapixels");
  EXPECT_THAT(refused(nullptr, "P6 1000000 1000000 255\n"), HasSubstr("expected at most 268 megapixels"));
  EXPECT_THAT(refused(nullptr, "GIF89a is no kind we take"), HasSubstr("cannot be decoded, expected an image: PNG"));
}

}  // namespace
}  // namespace tankrig
