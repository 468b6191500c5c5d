// Pictures as a camera sends them, converted to the rig's 8-bit image in one pass.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace tankrig {

/// Named as in the kernel's "Video for Linux" guide, chapter "Image Formats". A Bayer name is its first two rows.
enum class PixelFormat : std::uint8_t {
  kGrey,    ///< 8 bit
  kGrey16,  ///< 16 bit little-endian; the top eight are kept
  kYuyv,    ///< 4:2:2, Y0 U Y1 V
  kUyvy,    ///< 4:2:2, U Y0 V Y1
  kBgr24,   ///< B G R
  kRgb24,   ///< R G B
  kBayerRggb8,
  kBayerGrbg8,
  kBayerGbrg8,
  kBayerBggr8,
  kMjpeg,  ///< one baseline JPEG per picture
};

inline constexpr std::array kPixelFormats{PixelFormat::kGrey,       PixelFormat::kGrey16,     PixelFormat::kYuyv,
                                          PixelFormat::kUyvy,       PixelFormat::kBgr24,      PixelFormat::kRgb24,
                                          PixelFormat::kBayerRggb8, PixelFormat::kBayerGrbg8, PixelFormat::kBayerGbrg8,
                                          PixelFormat::kBayerBggr8, PixelFormat::kMjpeg};

/// The name in a rig file: "GREY" "Y16" "YUYV" "UYVY" "BGR24" "RGB24" "RGGB" "GRBG" "GBRG" "BGGR" "MJPEG".
const char* to_string(PixelFormat format) noexcept;
std::optional<PixelFormat> pixel_format_from(std::string_view name) noexcept;

/// Video for Linux's four-character code.
std::uint32_t fourcc_of(PixelFormat format) noexcept;
std::optional<PixelFormat> pixel_format_from_fourcc(std::uint32_t fourcc) noexcept;
/// Its four characters, e.g. "YUYV"; what is not printable as '?'.
std::string fourcc_text(std::uint32_t fourcc);

/// Bytes of one row without padding; 0 for kMjpeg.
std::size_t row_bytes(PixelFormat format, int width) noexcept;
/// Bytes a picture needs when its rows begin `stride` bytes apart (the last row needs no padding); 0 for kMjpeg.
std::size_t picture_bytes(PixelFormat format, int width, int height, std::size_t stride) noexcept;

/// A picture in foreign memory.
struct RawPicture {
  PixelFormat format = PixelFormat::kGrey;
  int width = 0, height = 0;  ///< [px]; a JPEG must have exactly these
  std::size_t stride = 0;     ///< bytes from row to row; 0: rows are packed
  std::span<const std::uint8_t> bytes;
  bool full_range = false;  ///< kYuyv, kUyvy: Y and chroma use 0..255; else ITU-R BT.601's 16..235, 16..240
};

/// Converts to an image with its own memory, 8-bit, `channels` 1 or 3 (BGR), without another copy. To one channel: luma
/// as coded (YUV; head room above 235 is kept), weighted 0.299 R + 0.587 G + 0.114 B (RGB, Bayer). To three: ITU-R
/// BT.601 (YUV), bilinear (Bayer). JPEG: full range, as in JFIF.
/// Errors: kProtocol, the bytes are short or damaged; kOutOfRange, a width, height, stride or channel count cannot be.
/// Threads: any.
/// RT: never.
Result<cv::Mat> to_image(const RawPicture& picture, int channels);

}  // namespace tankrig
