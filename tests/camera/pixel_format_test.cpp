// Pixel formats against pixels worked out by hand, and against bytes of every wrong kind.
#include "drivers/camera/pixel_format.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

#include "drivers/camera/jpeg_decoder.hpp"

namespace tankrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

cv::Mat image_of(PixelFormat format, int width, int height, const Bytes& bytes, int channels, std::size_t stride = 0,
                 bool full_range = false) {
  Result<cv::Mat> image = to_image({format, width, height, stride, bytes, full_range}, channels);
  EXPECT_TRUE(image.ok()) << (image.ok() ? "" : image.error().where);
  return image.ok() ? image.value() : cv::Mat();
}

ErrorCode error_of(const RawPicture& picture, int channels = 1) {
  const Result<cv::Mat> image = to_image(picture, channels);
  EXPECT_FALSE(image.ok());
  return image.ok() ? ErrorCode::kInternal : image.error().code;
}

void expect_pixel(const cv::Mat& image, int x, int y, int b, int g, int r, int tolerance = 0) {
  const cv::Vec3b pixel = image.at<cv::Vec3b>(y, x);
  EXPECT_NEAR(pixel[0], b, tolerance) << "blue at " << x << ", " << y;
  EXPECT_NEAR(pixel[1], g, tolerance) << "green at " << x << ", " << y;
  EXPECT_NEAR(pixel[2], r, tolerance) << "red at " << x << ", " << y;
}

TEST(PixelFormat, NamesAndFourCharacterCodesGoThereAndBack) {
  for (PixelFormat format : kPixelFormats) {
    EXPECT_EQ(pixel_format_from(to_string(format)), format);
    EXPECT_EQ(pixel_format_from_fourcc(fourcc_of(format)), format);
  }
  EXPECT_EQ(fourcc_of(PixelFormat::kYuyv), 0x56595559u);
  EXPECT_EQ(fourcc_text(0x56595559), "YUYV");
  EXPECT_EQ(fourcc_text(fourcc_of(PixelFormat::kBayerBggr8)), "BA81");
  EXPECT_EQ(fourcc_text(0x01020304), "????");
  EXPECT_EQ(pixel_format_from("yuyv"), std::nullopt);
  EXPECT_EQ(pixel_format_from_fourcc(0), std::nullopt);
}

TEST(PixelFormat, GreyIsClonedRowByRowWithoutItsPadding) {
  Bytes bytes{1, 2, 3, 99, 4, 5, 6};  // the last row's padding may be missing
  const cv::Mat grey = image_of(PixelFormat::kGrey, 3, 2, bytes, 1, 4);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 2), 3);
  EXPECT_EQ(grey.at<std::uint8_t>(1, 0), 4);
  EXPECT_EQ(grey.at<std::uint8_t>(1, 2), 6);
  bytes[0] = 77;
  EXPECT_EQ(grey.at<std::uint8_t>(0, 0), 1) << "the image must not lie in the wire's memory";
  expect_pixel(image_of(PixelFormat::kGrey, 3, 2, bytes, 3, 4), 1, 1, 5, 5, 5);
}

TEST(PixelFormat, SixteenBitsKeepTheTopEight) {
  const Bytes bytes{0xff, 0x12, 0x00, 0xfe};
  const cv::Mat grey = image_of(PixelFormat::kGrey16, 2, 1, bytes, 1);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 0), 0x12);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 1), 0xfe);
  expect_pixel(image_of(PixelFormat::kGrey16, 2, 1, bytes, 3), 1, 0, 0xfe, 0xfe, 0xfe);
}

TEST(PixelFormat, PackedColoursKeepTheirOrder) {
  const Bytes bytes{10, 20, 30, 40, 50, 60, 0, 0, 70, 80, 90, 100, 110, 120};
  expect_pixel(image_of(PixelFormat::kBgr24, 2, 2, bytes, 3, 8), 1, 1, 100, 110, 120);
  expect_pixel(image_of(PixelFormat::kRgb24, 2, 2, bytes, 3, 8), 1, 1, 120, 110, 100);
  // 0.299 R + 0.587 G + 0.114 B of (R, G, B) = (30, 20, 10) and (10, 20, 30)
  EXPECT_NEAR(image_of(PixelFormat::kBgr24, 2, 2, bytes, 1, 8).at<std::uint8_t>(0, 0), 21.85, 0.5);
  EXPECT_NEAR(image_of(PixelFormat::kRgb24, 2, 2, bytes, 1, 8).at<std::uint8_t>(0, 0), 18.15, 0.5);
}

TEST(PixelFormat, LumaOfYuvIsAsCoded) {
  const Bytes yuyv{16, 128, 235, 128, 255, 90, 0, 240};
  const Bytes uyvy{128, 16, 128, 235, 90, 255, 240, 0};
  for (const cv::Mat& grey :
       {image_of(PixelFormat::kYuyv, 4, 1, yuyv, 1), image_of(PixelFormat::kUyvy, 4, 1, uyvy, 1)}) {
    EXPECT_EQ(grey.at<std::uint8_t>(0, 0), 16);
    EXPECT_EQ(grey.at<std::uint8_t>(0, 1), 235);
    EXPECT_EQ(grey.at<std::uint8_t>(0, 2), 255);
    EXPECT_EQ(grey.at<std::uint8_t>(0, 3), 0);
  }
}

// ITU-R BT.601, limited range: R = 1.164 (Y-16) + 1.596 (V-128), G = 1.164 (Y-16) - 0.392 (U-128) - 0.813 (V-128),
// B = 1.164 (Y-16) + 2.017 (U-128).
TEST(PixelFormat, LimitedRangeYuvBecomesColourByBt601) {
  const Bytes yuyv{16,  128, 235, 128,   // black, white
                   81,  90,  145, 240,   // pure red's code, and luma 145 with the same chroma
                   100, 110, 100, 150,   // R 132.9, G 86.9 (87), B 61.5
                   41,  240, 41,  110};  // pure blue's code
  const Bytes uyvy{128, 16, 128, 235, 90, 81, 240, 145, 110, 100, 150, 100, 240, 41, 110, 41};
  for (const cv::Mat& bgr :
       {image_of(PixelFormat::kYuyv, 8, 1, yuyv, 3), image_of(PixelFormat::kUyvy, 8, 1, uyvy, 3)}) {
    expect_pixel(bgr, 0, 0, 0, 0, 0, 1);
    expect_pixel(bgr, 1, 0, 255, 255, 255, 1);
    expect_pixel(bgr, 2, 0, 0, 0, 254, 1);
    expect_pixel(bgr, 3, 0, 74, 74, 255, 1);
    expect_pixel(bgr, 4, 0, 61, 87, 133, 1);
    expect_pixel(bgr, 6, 0, 255, 0, 0, 1);
  }
}

TEST(PixelFormat, FullRangeYuvBecomesColourByJfif) {
  const Bytes yuyv{0, 128, 255, 128, 76, 85, 76, 255, 100, 110, 100, 150};
  const Bytes uyvy{128, 0, 128, 255, 85, 76, 255, 76, 110, 100, 150, 100};
  for (const cv::Mat& bgr :
       {image_of(PixelFormat::kYuyv, 6, 1, yuyv, 3, 0, true), image_of(PixelFormat::kUyvy, 6, 1, uyvy, 3, 0, true)}) {
    expect_pixel(bgr, 0, 0, 0, 0, 0);
    expect_pixel(bgr, 1, 0, 255, 255, 255);
    expect_pixel(bgr, 2, 0, 0, 0, 254, 0);    // 76 + 1.402 * 127 = 254.05
    expect_pixel(bgr, 4, 0, 68, 90, 131, 0);  // 100 - 31.9, 100 + 6.19 - 15.71, 100 + 30.84
  }
}

/// A picture of one colour in the mosaic whose first two rows are `pattern`, e.g. "RGGB".
Bytes mosaic(const std::string& pattern, int width, int height, std::size_t stride, std::uint8_t red,
             std::uint8_t green, std::uint8_t blue) {
  Bytes bytes(stride * static_cast<std::size_t>(height), 0xee);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const char colour = pattern[static_cast<std::size_t>(2 * (y % 2) + x % 2)];
      bytes[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)] = colour == 'R'   ? red
                                                                                  : colour == 'G' ? green
                                                                                                  : blue;
    }
  return bytes;
}

TEST(PixelFormat, EveryBayerPatternGivesItsUniformColourEverywhere) {
  for (PixelFormat format :
       {PixelFormat::kBayerRggb8, PixelFormat::kBayerGrbg8, PixelFormat::kBayerGbrg8, PixelFormat::kBayerBggr8}) {
    SCOPED_TRACE(to_string(format));
    const Bytes bytes = mosaic(to_string(format), 10, 6, 13, 200, 100, 40);
    const cv::Mat bgr = image_of(format, 10, 6, bytes, 3, 13);
    const cv::Mat grey = image_of(format, 10, 6, bytes, 1, 13);
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 10; ++x) {
        expect_pixel(bgr, x, y, 40, 100, 200);
        EXPECT_NEAR(grey.at<std::uint8_t>(y, x), 123.06, 1.0);  // 0.299 * 200 + 0.587 * 100 + 0.114 * 40
      }
  }
}

TEST(PixelFormat, BayerNeighboursAreAveraged) {
  Bytes bytes(36, 0);
  bytes[2 * 6 + 2] = 200;  // one red site of RGGB, lit
  const cv::Mat bgr = image_of(PixelFormat::kBayerRggb8, 6, 6, bytes, 3);
  expect_pixel(bgr, 2, 2, 0, 0, 200);
  expect_pixel(bgr, 3, 2, 0, 0, 100);
  expect_pixel(bgr, 2, 1, 0, 0, 100);
  expect_pixel(bgr, 3, 3, 0, 0, 50);
  expect_pixel(bgr, 4, 2, 0, 0, 0);
}

Bytes jpeg_of(const cv::Mat& image) {
  Bytes bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
  return bytes;
}

cv::Mat smooth_picture(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.at<cv::Vec3b>(y, x) = cv::Vec3b(static_cast<std::uint8_t>(2 * x), static_cast<std::uint8_t>(4 * y),
                                            static_cast<std::uint8_t>(200 - 2 * x));
  return image;
}

/// Without its Huffman tables, as cameras of the USB video class send them.
Bytes without_huffman_tables(const Bytes& jpeg) {
  Bytes out(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  while (jpeg[at + 1] != 0xda) {
    const std::size_t length = 2u + jpeg[at + 2] * 256u + jpeg[at + 3];
    if (jpeg[at + 1] != 0xc4)
      out.insert(out.end(), jpeg.begin() + static_cast<long>(at), jpeg.begin() + static_cast<long>(at + length));
    at += length;
  }
  out.insert(out.end(), jpeg.begin() + static_cast<long>(at), jpeg.end());
  return out;
}

TEST(PixelFormat, MotionJpegIsDecodedWithAndWithoutItsHuffmanTables) {
  const cv::Mat truth = smooth_picture(96, 48);
  const Bytes whole = jpeg_of(truth), bare = without_huffman_tables(whole);
  ASSERT_LT(bare.size(), whole.size() - 400);
  for (const Bytes& bytes : {whole, bare}) {
    const cv::Mat bgr = image_of(PixelFormat::kMjpeg, 96, 48, bytes, 3);
    ASSERT_EQ(bgr.size(), truth.size());
    EXPECT_LT(cv::norm(bgr, truth, cv::NORM_L1) / (3.0 * 96 * 48), 2.0);
    const cv::Mat grey = image_of(PixelFormat::kMjpeg, 96, 48, bytes, 1);
    EXPECT_NEAR(grey.at<std::uint8_t>(20, 40), 0.114 * 80 + 0.587 * 80 + 0.299 * 120, 3);
  }
}

TEST(PixelFormat, MotionJpegCutAnywhereOrOfAnotherSizeIsRefused) {
  const Bytes whole = jpeg_of(smooth_picture(96, 48));
  for (std::size_t size = 0; size + 2 < whole.size(); size += 7)
    EXPECT_EQ(error_of({PixelFormat::kMjpeg, 96, 48, 0, std::span(whole).first(size), false}), ErrorCode::kProtocol);
  EXPECT_EQ(error_of({PixelFormat::kMjpeg, 96, 50, 0, whole, false}), ErrorCode::kProtocol);
  Bytes padded = whole;
  padded.resize(whole.size() + 1000, 0);  // a camera's buffer is longer than its picture
  EXPECT_TRUE(to_image({PixelFormat::kMjpeg, 96, 48, 0, padded, false}, 1).ok());
}

TEST(PixelFormat, ShortBuffersAndImpossibleSizesAreErrors) {
  const Bytes bytes(64, 7);
  const auto all = std::span<const std::uint8_t>(bytes);
  EXPECT_EQ(error_of({PixelFormat::kGrey, 8, 8, 0, all.first(63), false}), ErrorCode::kProtocol);
  EXPECT_EQ(error_of({PixelFormat::kYuyv, 8, 4, 17, all, false}), ErrorCode::kProtocol);
  EXPECT_EQ(error_of({PixelFormat::kGrey, 8, 8, 7, all, false}), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of({PixelFormat::kGrey, 0, 8, 0, all, false}), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of({PixelFormat::kGrey, 8, -1, 0, all, false}), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of({PixelFormat::kYuyv, 7, 2, 0, all, false}), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of({PixelFormat::kBayerRggb8, 8, 3, 0, all, false}), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of({PixelFormat::kGrey, 8, 8, 0, all, false}, 2), ErrorCode::kOutOfRange);
  EXPECT_EQ(error_of({PixelFormat::kGrey, 1 << 30, 1 << 30, 0, all, false}), ErrorCode::kOutOfRange);
}

TEST(PixelFormatFuzz, AnySizesStridesAndFormatsGiveAnImageOrAnError) {
  const unsigned seed = 20240611;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  int sound = 0;
  for (int i = 0; i < 100000; ++i) {
    const PixelFormat format = kPixelFormats[random() % kPixelFormats.size()];
    const int width = static_cast<int>(random() % 20) - 1, height = static_cast<int>(random() % 12) - 1;
    const std::size_t stride = random() % 3 == 0 ? 0 : random() % 64;
    // Exactly as long as its allocation: the address sanitizer sees any read past the end.
    Bytes bytes(random() % 400);
    bytes.shrink_to_fit();
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const int channels = random() % 2 == 0 ? 1 : 3;
    const Result<cv::Mat> image = to_image({format, width, height, stride, bytes, random() % 2 == 0}, channels);
    if (!image.ok()) continue;
    ++sound;
    ASSERT_EQ(image.value().cols, width);
    ASSERT_EQ(image.value().rows, height);
    ASSERT_EQ(image.value().type(), CV_8UC(channels));
    ASSERT_GE(bytes.size(), picture_bytes(format, width, height, stride ? stride : row_bytes(format, width)));
  }
  EXPECT_GT(sound, 10000);
}

TEST(PixelFormatFuzz, DamagedJpegNeitherCrashesNorPrints) {
  const unsigned seed = 4711;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  const Bytes whole = jpeg_of(smooth_picture(48, 32));
  int refused = 0;
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes = whole;
    if (i % 10 == 0) {
      bytes.assign(random() % 200, 0);
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
      if (bytes.size() > 3) bytes[0] = 0xff, bytes[1] = 0xd8, bytes[2] = 0xff;
    } else {
      for (unsigned n = 1 + random() % 6; n > 0; --n)
        bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
      if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    }
    const Result<cv::Mat> image = decode_jpeg(bytes, 48, 32, random() % 2 == 0 ? 1 : 3);
    if (!image.ok()) ++refused;
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(refused, 2000);
}

}  // namespace
}  // namespace tankrig
