#include "drivers/camera/pixel_format.hpp"

#include <opencv2/imgproc.hpp>

#include "drivers/camera/jpeg_decoder.hpp"

namespace tankrig {
namespace {

constexpr std::uint32_t code(const char (&c)[5]) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<std::uint8_t>(c[i]);
  return value;
}

struct FormatRow {
  PixelFormat format;
  const char* name;
  std::uint32_t fourcc;
  int bytes_per_pixel;  ///< 0: compressed
  int step;             ///< width must be a multiple of it
};

constexpr std::array kFormats{
    FormatRow{PixelFormat::kGrey, "GREY", code("GREY"), 1, 1},
    FormatRow{PixelFormat::kGrey16, "Y16", code("Y16 "), 2, 1},
    FormatRow{PixelFormat::kYuyv, "YUYV", code("YUYV"), 2, 2},
    FormatRow{PixelFormat::kUyvy, "UYVY", code("UYVY"), 2, 2},
    FormatRow{PixelFormat::kBgr24, "BGR24", code("BGR3"), 3, 1},
    FormatRow{PixelFormat::kRgb24, "RGB24", code("RGB3"), 3, 1},
    FormatRow{PixelFormat::kBayerRggb8, "RGGB", code("RGGB"), 1, 2},
    FormatRow{PixelFormat::kBayerGrbg8, "GRBG", code("GRBG"), 1, 2},
    FormatRow{PixelFormat::kBayerGbrg8, "GBRG", code("GBRG"), 1, 2},
    FormatRow{PixelFormat::kBayerBggr8, "BGGR", code("BA81"), 1, 2},
    FormatRow{PixelFormat::kMjpeg, "MJPEG", code("MJPG"), 0, 1},
};

const FormatRow& row_of(PixelFormat format) noexcept { return kFormats[static_cast<std::size_t>(format)]; }

bool is_bayer(PixelFormat format) { return format >= PixelFormat::kBayerRggb8 && format <= PixelFormat::kBayerBggr8; }

constexpr int kMaximumSide_px = 1 << 14;

Error error(ErrorCode code_of_error, const char* where) { return Error{code_of_error, 0, {}, where}; }

int grey_code(PixelFormat format) {
  switch (format) {
    case PixelFormat::kRgb24:
      return cv::COLOR_RGB2GRAY;
    case PixelFormat::kBayerRggb8:
      return cv::COLOR_BayerRGGB2GRAY;
    case PixelFormat::kBayerGrbg8:
      return cv::COLOR_BayerGRBG2GRAY;
    case PixelFormat::kBayerGbrg8:
      return cv::COLOR_BayerGBRG2GRAY;
    case PixelFormat::kBayerBggr8:
      return cv::COLOR_BayerBGGR2GRAY;
    default:
      return cv::COLOR_BGR2GRAY;
  }
}

int bgr_code(PixelFormat format) {
  switch (format) {
    case PixelFormat::kYuyv:
      return cv::COLOR_YUV2BGR_YUY2;
    case PixelFormat::kUyvy:
      return cv::COLOR_YUV2BGR_UYVY;
    case PixelFormat::kRgb24:
      return cv::COLOR_RGB2BGR;
    case PixelFormat::kBayerRggb8:
      return cv::COLOR_BayerRGGB2BGR;
    case PixelFormat::kBayerGrbg8:
      return cv::COLOR_BayerGRBG2BGR;
    case PixelFormat::kBayerGbrg8:
      return cv::COLOR_BayerGBRG2BGR;
    case PixelFormat::kBayerBggr8:
      return cv::COLOR_BayerBGGR2BGR;
    default:
      return cv::COLOR_GRAY2BGR;
  }
}

/// BT.601 with Y and chroma over 0..255 (as JFIF): R = Y + 1.402 V, G = Y - 0.344136 U - 0.714136 V, B = Y + 1.772 U.
void full_range_to_bgr(const cv::Mat& pairs, bool luma_first, cv::Mat& bgr) {
  constexpr int kOne = 1 << 16, kHalf = kOne / 2;
  const int y_at = luma_first ? 0 : 1, u_at = luma_first ? 1 : 0;
  bgr.create(pairs.size(), CV_8UC3);
  for (int row = 0; row < pairs.rows; ++row) {
    const std::uint8_t* in = pairs.ptr(row);
    std::uint8_t* out = bgr.ptr(row);
    for (int x = 0; x < pairs.cols; x += 2, in += 4, out += 6) {
      const int u = in[u_at] - 128, v = in[u_at + 2] - 128;
      const int blue = 116130 * u + kHalf, green = -22553 * u - 46802 * v + kHalf, red = 91881 * v + kHalf;
      for (int i = 0; i < 2; ++i) {
        const int y = in[y_at + 2 * i] * kOne;
        out[3 * i + 0] = cv::saturate_cast<std::uint8_t>((y + blue) >> 16);
        out[3 * i + 1] = cv::saturate_cast<std::uint8_t>((y + green) >> 16);
        out[3 * i + 2] = cv::saturate_cast<std::uint8_t>((y + red) >> 16);
      }
    }
  }
}

void high_bytes_to_bgr(const cv::Mat& words, cv::Mat& bgr) {
  const int from_to[] = {1, 0, 1, 1, 1, 2};
  bgr.create(words.size(), CV_8UC3);
  cv::mixChannels(&words, 1, &bgr, 1, from_to, 3);
}

cv::Mat to_grey(PixelFormat format, const cv::Mat& in) {
  cv::Mat out;
  switch (format) {
    case PixelFormat::kGrey:
      in.copyTo(out);
      break;
    case PixelFormat::kGrey16:
      cv::extractChannel(in, out, 1);
      break;
    case PixelFormat::kYuyv:
      cv::extractChannel(in, out, 0);
      break;
    case PixelFormat::kUyvy:
      cv::extractChannel(in, out, 1);
      break;
    default:
      cv::cvtColor(in, out, grey_code(format));
      break;
  }
  return out;
}

cv::Mat to_bgr(PixelFormat format, const cv::Mat& in, bool full_range) {
  cv::Mat out;
  const bool yuv = format == PixelFormat::kYuyv || format == PixelFormat::kUyvy;
  if (format == PixelFormat::kBgr24)
    in.copyTo(out);
  else if (format == PixelFormat::kGrey16)
    high_bytes_to_bgr(in, out);
  else if (yuv && full_range)
    full_range_to_bgr(in, format == PixelFormat::kYuyv, out);
  else
    cv::cvtColor(in, out, bgr_code(format));
  return out;
}

}  // namespace

const char* to_string(PixelFormat format) noexcept { return row_of(format).name; }

std::optional<PixelFormat> pixel_format_from(std::string_view name) noexcept {
  for (const FormatRow& row : kFormats)
    if (name == row.name) return row.format;
  return std::nullopt;
}

std::uint32_t fourcc_of(PixelFormat format) noexcept { return row_of(format).fourcc; }

std::optional<PixelFormat> pixel_format_from_fourcc(std::uint32_t fourcc) noexcept {
  if (fourcc == code("JPEG")) return PixelFormat::kMjpeg;
  for (const FormatRow& row : kFormats)
    if (fourcc == row.fourcc) return row.format;
  return std::nullopt;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i, fourcc >>= 8) {
    const char c = static_cast<char>(fourcc & 0x7f);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text;
}

std::size_t row_bytes(PixelFormat format, int width) noexcept {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(row_of(format).bytes_per_pixel);
}

std::size_t picture_bytes(PixelFormat format, int width, int height, std::size_t stride) noexcept {
  if (row_of(format).bytes_per_pixel == 0 || height < 1) return 0;
  return stride * static_cast<std::size_t>(height - 1) + row_bytes(format, width);
}

Result<cv::Mat> to_image(const RawPicture& picture, int channels) {
  const auto [format, width, height, given_stride, bytes, full_range] = picture;
  const FormatRow& row = row_of(format);
  if (channels != 1 && channels != 3) return error(ErrorCode::kOutOfRange, "picture: channels must be 1 or 3");
  if (width < 1 || height < 1 || width > kMaximumSide_px || height > kMaximumSide_px || width % row.step != 0)
    return error(ErrorCode::kOutOfRange, "picture: a size that its format cannot have");
  if (format == PixelFormat::kMjpeg) return decode_jpeg(bytes, width, height, channels);

  const std::size_t stride = given_stride == 0 ? row_bytes(format, width) : given_stride;
  if (stride < row_bytes(format, width) || stride > std::size_t{kMaximumSide_px} * 16)
    return error(ErrorCode::kOutOfRange, "picture: rows closer together than they are long");
  if (is_bayer(format) && (width < 4 || height < 4 || height % 2 != 0))
    return error(ErrorCode::kOutOfRange, "picture: a size that its format cannot have");
  if (bytes.size() < picture_bytes(format, width, height, stride))
    return error(ErrorCode::kProtocol, "picture: fewer bytes than its size needs");

  const cv::Mat in(height, width, CV_8UC(row.bytes_per_pixel), const_cast<std::uint8_t*>(bytes.data()), stride);
  return channels == 1 ? to_grey(format, in) : to_bgr(format, in, full_range);
}

}  // namespace tankrig
