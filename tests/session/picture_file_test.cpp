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
  cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 255);
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

/// A grey TIFF whose directory comes first: what is cut off are pixels. OpenCV writes it last.
std::string tiff_with_its_directory_first() {
  constexpr int kWidth = 300, kHeight = 37, kRowsPerStrip = 8, kStrips = 5, kEntries = 9;
  std::string out("II*\0\x08\0\0\0", 8);
  const auto put = [&](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> 8 * i);
  };
  const std::uint32_t lists = 8 + 2 + 12 * kEntries + 4, pixels = lists + 2 * 4 * kStrips;
  put(kEntries, 2);
  const auto entry = [&](int tag, int type, std::uint32_t count, std::uint32_t value) {
    put(static_cast<std::uint32_t>(tag), 2), put(static_cast<std::uint32_t>(type), 2), put(count, 4), put(value, 4);
  };
  entry(256, 3, 1, kWidth), entry(257, 3, 1, kHeight), entry(258, 3, 1, 8), entry(259, 3, 1, 1), entry(262, 3, 1, 1);
  entry(273, 4, kStrips, lists), entry(277, 3, 1, 1), entry(278, 3, 1, kRowsPerStrip);
  entry(279, 4, kStrips, lists + 4 * kStrips), put(0, 4);
  for (int i = 0; i < kStrips; ++i) put(pixels + static_cast<std::uint32_t>(i) * kRowsPerStrip * kWidth, 4);
  for (int i = 0; i < kStrips; ++i)
    put(static_cast<std::uint32_t>(std::min(kRowsPerStrip, kHeight - i * kRowsPerStrip)) * kWidth, 4);
  for (int i = 0; i < kWidth * kHeight; ++i) out += static_cast<char>(i * 37);
  return out;
}

TEST(DecodePicture, RefusesEveryKindOfPictureWhereverItIsCut) {
  const std::vector<int> plain{cv::IMWRITE_TIFF_COMPRESSION, 1};
  const std::pair<const char*, std::string> pictures[] = {
      {"PNG", encoded(".png", CV_8UC3)},
      {"PNG of 16 bits", encoded(".png", CV_16UC1)},
      {"JPEG", encoded(".jpg", CV_8UC3)},
      {"progressive JPEG", encoded(".jpg", CV_8UC1, {cv::IMWRITE_JPEG_PROGRESSIVE, 1})},
      {"BMP", encoded(".bmp", CV_8UC3)},
      {"grey BMP", encoded(".bmp", CV_8UC1)},
      {"LZW TIFF", encoded(".tif", CV_8UC3)},
      {"TIFF", encoded(".tif", CV_16UC1, plain)},
      {"TIFF with its directory first", tiff_with_its_directory_first()},
      {"PPM", encoded(".ppm", CV_8UC3)},
      {"PGM", encoded(".pgm", CV_8UC1)},
      {"PGM of 16 bits", encoded(".pgm", CV_16UC1)},
      {"PBM", encoded(".pbm", CV_8UC1)},
  };
  for (const auto& [kind, picture] : pictures) {
    const auto decode = [](std::string_view bytes) {
      return decode_picture(bytes, "a", nullptr, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
    };
    EXPECT_EQ(decode(picture).size(), cv::Size(300, 37)) << kind;
    std::vector<std::size_t> cuts{0, 1, picture.size() / 2, picture.size() - 1};
    for (std::size_t cut = 2; cut < picture.size(); cut += 1 + picture.size() / 97) cuts.push_back(cut);
    for (const std::size_t cut : cuts)
      EXPECT_THROW(decode(std::string_view(picture).substr(0, cut)), DamagedPicture)
          << kind << " cut at " << cut << " of " << picture.size();
  }
}

TEST(DecodePicture, RefusesAJpegThatTheDecoderFillsUp) {
  const std::string jpeg = encoded(".jpg", CV_8UC3);
  const auto error = [](const std::string& bytes) {
    return message_of<DamagedPicture>([&] { decode_picture(bytes, "a.jpg", nullptr, cv::IMREAD_COLOR); });
  };
  const auto opencv_takes = [](const std::string& bytes) {
    return !cv::imdecode(std::vector<unsigned char>(bytes.begin(), bytes.end()), cv::IMREAD_COLOR).empty();
  };
  ASSERT_EQ(error(jpeg), "no error");
  for (const std::size_t missing : {1000, 2000, 5000}) {  // a JPEG has no check sum: a small gap may happen to fit
    std::string gap = jpeg, zeros = jpeg;
    gap.erase(jpeg.size() / 2, missing);
    zeros.replace(jpeg.size() / 2, missing, missing, '\0');
    ASSERT_TRUE(is_whole_jpeg(gap) && is_whole_jpeg(zeros)) << "to its end";
    ASSERT_TRUE(opencv_takes(gap) && opencv_takes(zeros)) << "all the same";
    EXPECT_THAT(error(gap), HasSubstr("a.jpg: is a JPEG that is damaged, expected a sound one")) << missing;
    EXPECT_THAT(error(zeros), HasSubstr("a.jpg: is a JPEG that is damaged")) << missing;
  }
  const auto padded = [&](std::size_t bytes) { return std::string(jpeg).insert(jpeg.size() - 2, bytes, '\0'); };
  EXPECT_EQ(error(padded(4)), "no error") << "webcams do this";
  EXPECT_THAT(error(padded(400)), HasSubstr("a.jpg: is a JPEG that is damaged")) << "the picture was longer";
}

TEST(DecodePicture, RefusesAPngWithAWrongCheckSumAndTakesWhatFollowsItsEnd) {
  const std::string png = encoded(".png", CV_8UC1);
  const auto error = [](const std::string& bytes) {
    return message_of<DamagedPicture>([&] { decode_picture(bytes, "a.png", nullptr, cv::IMREAD_ANYCOLOR); });
  };
  std::string flipped = png;
  flipped[png.size() / 2] = static_cast<char>(flipped[png.size() / 2] ^ 1);
  EXPECT_THAT(error(flipped), HasSubstr("a.png: is a PNG that is cut short or damaged, expected a whole one"));
  EXPECT_EQ(error(png + "a maker's own notes"), "no error");
  EXPECT_EQ(error(""), "a.png: is empty, expected an image");
}

}  // namespace
}  // namespace tankrig
