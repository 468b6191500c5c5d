// PNG: what is written reads back the same with OpenCV, and what is read is what OpenCV reads.
#include "session/recording/png_file.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"
#include "session/checking/crc32.hpp"

namespace tankrig {
namespace {

constexpr std::uint64_t kPngSeed = 5;

/// Smooth, so that filters and repeats occur, with a little noise.
cv::Mat some_picture(int width, int height, int type) {
  cv::Mat image(height, width, type);
  cv::RNG random(kPngSeed);
  for (int y = 0; y < height; ++y)
    for (int i = 0; i < width * image.channels(); ++i)
      image.ptr(y)[i] = static_cast<unsigned char>(3 * y + 2 * i + random.uniform(0, 3));
  return image;
}

cv::Mat by_opencv(const std::string& png) {
  return cv::imdecode(std::vector<unsigned char>(png.begin(), png.end()), cv::IMREAD_UNCHANGED);
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

std::string chunk(const std::string& type, const std::string& data) {
  return big_endian(static_cast<std::uint32_t>(data.size())) + type + data + big_endian(crc32(type + data));
}

/// A grey PNG of stored rows, in as many IDAT chunks as there are `pieces`.
std::string grey_png(std::uint32_t width, std::uint32_t height, const std::string& rows, std::size_t pieces = 1) {
  std::string zlib("\x78\x01\x01", 3);
  const auto n = static_cast<std::uint32_t>(rows.size());
  for (const std::uint32_t length : {n, ~n}) zlib += {static_cast<char>(length), static_cast<char>(length >> 8)};
  zlib += rows;
  std::uint32_t a = 1, b = 0;
  for (const unsigned char byte : rows) a = (a + byte) % 65521, b = (b + a) % 65521;
  zlib += big_endian(b << 16 | a);
  std::string png =
      "\x89PNG\r\n\x1a\n" + chunk("IHDR", big_endian(width) + big_endian(height) + std::string("\x08\0\0\0\0", 5));
  for (std::size_t i = 0; i < pieces; ++i) {
    const std::size_t begin = zlib.size() * i / pieces, end = zlib.size() * (i + 1) / pieces;
    png += chunk("IDAT", zlib.substr(begin, end - begin));
  }
  return png + chunk("IEND", "");
}

TEST(PngFile, ReadsBackWithOpenCvAndWithOurOwn) {
  for (const int type : {CV_8UC1, CV_8UC3})
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 200), cv::Size(641, 37)}) {
      const cv::Mat image = some_picture(size.width, size.height, type);
      const std::string png = png_of(image, "a.png");
      EXPECT_TRUE(is_whole_png(png));
      EXPECT_TRUE(same(by_opencv(png), image)) << size << type;
      EXPECT_TRUE(same(decode_plain_png(png), image)) << size << type;
    }
}

TEST(PngFile, OfAPartOfAnImageIsThatPart) {
  const cv::Mat part = some_picture(64, 48, CV_8UC3)(cv::Rect(5, 7, 31, 20));
  EXPECT_TRUE(same(decode_plain_png(png_of(part, "a.png")), part));
}

TEST(PngFile, OfAnotherKindIsRefused) {
  EXPECT_THROW(png_of(cv::Mat(4, 4, CV_16UC1, cv::Scalar(1)), "a.png"), InputError);
  EXPECT_THROW(png_of({}, "a.png"), InputError);
}

TEST(PlainPng, IsReadAsOpenCvReadsItWithEveryFilter) {
  constexpr std::uint32_t kWidth = 29, kHeight = 40;
  cv::RNG random(kPngSeed);
  std::string rows;
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    rows += static_cast<char>(y < 5 ? y : random.uniform(0, 5));
    for (std::uint32_t x = 0; x < kWidth; ++x) rows += static_cast<char>(random.uniform(0, 256));
  }
  for (const std::size_t pieces : {1, 7}) {
    const std::string png = grey_png(kWidth, kHeight, rows, pieces);
    EXPECT_TRUE(same(decode_plain_png(png), by_opencv(png))) << pieces;
  }
}

TEST(PlainPng, OfOpenCvsWritersIsReadAsOpenCvReadsIt) {
  for (const int type : {CV_8UC1, CV_8UC3})
    for (const int strategy : {cv::IMWRITE_PNG_STRATEGY_DEFAULT, cv::IMWRITE_PNG_STRATEGY_FILTERED,
                               cv::IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY, cv::IMWRITE_PNG_STRATEGY_RLE}) {
      const cv::Mat image = some_picture(150, 90, type);
      std::vector<unsigned char> png;
      cv::imencode(".png", image, png, {cv::IMWRITE_PNG_STRATEGY, strategy, cv::IMWRITE_PNG_COMPRESSION, 9});
      EXPECT_TRUE(same(decode_plain_png({reinterpret_cast<const char*>(png.data()), png.size()}), image)) << strategy;
    }
}

TEST(PlainPng, IsEmptyWhereItIsNotPlainOrItsDataDoNotFit) {
  std::vector<unsigned char> deep;
  cv::imencode(".png", cv::Mat(4, 4, CV_16UC1, cv::Scalar(1)), deep);
  EXPECT_TRUE(decode_plain_png({reinterpret_cast<const char*>(deep.data()), deep.size()}).empty());
  const std::string rows(4 * 5, '\0');
  EXPECT_FALSE(decode_plain_png(grey_png(4, 4, rows)).empty());
  EXPECT_TRUE(decode_plain_png(grey_png(4, 3, rows)).empty());
  EXPECT_TRUE(decode_plain_png(grey_png(4, 5, rows)).empty());
  EXPECT_TRUE(decode_plain_png(grey_png(0, 4, rows)).empty());
  EXPECT_TRUE(decode_plain_png(grey_png(1U << 31, 1U << 31, rows)).empty());
  std::string no_such_filter = rows;
  no_such_filter[5] = 5;
  EXPECT_TRUE(decode_plain_png(grey_png(4, 4, no_such_filter)).empty());
  const std::string png = grey_png(4, 4, rows);
  for (std::size_t bytes = 0; bytes < png.size() - 12; ++bytes)
    EXPECT_TRUE(decode_plain_png(std::string_view(png).substr(0, bytes)).empty()) << bytes;
}

}  // namespace
}  // namespace tankrig
