#include "session/reading/picture_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::int64_t kMostPixels = 1 << 28;  // the largest sensors on sale have 250 million

/// Bytes read as numbers; what lies beyond their end reads as 0.
struct Bytes {
  std::string_view all;
  bool little = false;

  std::uint32_t u8(std::size_t at) const { return at < all.size() ? static_cast<unsigned char>(all[at]) : 0; }
  std::uint32_t u16(std::size_t at) const { return little ? u8(at) | u8(at + 1) << 8 : u8(at) << 8 | u8(at + 1); }
  std::uint32_t u32(std::size_t at) const { return little ? u16(at) | u16(at + 2) << 16 : u16(at) << 16 | u16(at + 2); }
};

using Sides = std::pair<std::int64_t, std::int64_t>;

Sides png_sides(std::string_view png) {
  const Bytes bytes{png};
  return {bytes.u32(16), bytes.u32(20)};
}

/// Of its frame header, behind any other segments.
Sides jpeg_sides(std::string_view jpeg) {
  const Bytes bytes{jpeg};
  for (std::size_t at = 2; at + 8 < jpeg.size() && bytes.u8(at) == 0xff;) {
    const std::uint32_t marker = bytes.u8(at + 1);
    if (marker == 0xff) {
      ++at;
      continue;
    }
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) return {bytes.u16(at + 7), bytes.u16(at + 5)};
    at += 2 + bytes.u16(at + 2);
  }
  return {};
}

Sides bmp_sides(std::string_view bmp) {
  const Bytes bytes{bmp, true};
  if (bytes.u32(14) == 12) return {bytes.u16(18), bytes.u16(20)};
  const auto rows = static_cast<std::int32_t>(bytes.u32(22));  // negative: from the top down
  return {static_cast<std::int32_t>(bytes.u32(18)), std::abs(static_cast<std::int64_t>(rows))};
}

/// Of its first picture; none where a side is given twice, or as no number that a picture has: whoever decodes it may
/// read another one.
Sides tiff_sides(std::string_view tiff) {
  constexpr std::uint32_t kWidth = 256, kHeight = 257, kShort = 3, kLong = 4;
  const Bytes bytes{tiff, tiff.starts_with('I')};
  const std::size_t directory = bytes.u32(4);
  Sides sides;
  for (std::size_t i = 0, entries = bytes.u16(directory); i < entries; ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    const std::uint32_t tag = bytes.u16(entry), type = bytes.u16(entry + 2);
    if (tag != kWidth && tag != kHeight) continue;
    std::int64_t& side = tag == kWidth ? sides.first : sides.second;
    if (side != 0 || (type != kShort && type != kLong)) return {};
    side = type == kShort ? bytes.u16(entry + 8) : bytes.u32(entry + 8);
  }
  return sides;
}

/// Of PBM, PGM and PPM: two numbers after the first two characters, comments between them.
Sides pnm_sides(std::string_view pnm) {
  std::int64_t sides[2] = {};
  std::size_t at = 2;
  for (std::int64_t& side : sides) {
    while (at < pnm.size() && (std::isspace(static_cast<unsigned char>(pnm[at])) || pnm[at] == '#'))
      at = pnm[at] == '#' ? std::min(pnm.find('\n', at), pnm.size()) : at + 1;
    for (; at < pnm.size() && std::isdigit(static_cast<unsigned char>(pnm[at])) && side <= kMostPixels; ++at)
      side = 10 * side + (pnm[at] - '0');
  }
  return {sides[0], sides[1]};
}

Sides sides_of(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return png_sides(bytes);
  if (bytes.starts_with("\xff\xd8\xff")) return jpeg_sides(bytes);
  if (bytes.starts_with("BM")) return bmp_sides(bytes);
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return tiff_sides(bytes);
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') return pnm_sides(bytes);
  return {};
}

std::string sides_text(int width, int height) { return fmt::format("{} x {}", width, height); }

}  // namespace

std::optional<cv::Size> picture_size(std::string_view bytes) {
  constexpr std::int64_t kMostSide =
      1 << 30;  // fits a cv::Size; far beyond kMostPixels in a picture that has two sides
  const auto [width, height] = sides_of(bytes);
  if (width < 1 || height < 1) return std::nullopt;
  return cv::Size(static_cast<int>(std::min(width, kMostSide)), static_cast<int>(std::min(height, kMostSide)));
}

bool is_whole_jpeg(std::string_view bytes) {
  constexpr unsigned kStart = 0xd8, kEnd = 0xd9, kScan = 0xda, kFirstRestart = 0xd0, kLastRestart = 0xd7;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  if (bytes.size() < 4 || byte(0) != 0xff || byte(1) != kStart) return false;
  bool picture = false;  // a scan was there
  for (std::size_t at = 2; at + 1 < bytes.size();) {
    if (byte(at) != 0xff || byte(at + 1) == 0xff || byte(at + 1) == 0) {
      if (!picture && byte(at) != 0xff) return false;  // only a scan holds anything but segments
      ++at;
      continue;
    }
    const unsigned marker = byte(at + 1);
    at += 2;
    if (marker == kEnd) return picture;
    if (marker >= kFirstRestart && marker <= kLastRestart) continue;
    if (at + 1 >= bytes.size()) return false;
    picture = picture || marker == kScan;
    at += byte(at) << 8 | byte(at + 1);
  }
  return false;
}

cv::Mat decode_picture(std::string_view bytes, const std::filesystem::path& file, const ExpectedSize* expected,
                       int flags) {
  const auto size = picture_size(bytes);
  if (!size) throw InputError(file, "cannot be decoded, expected an image: PNG, JPEG, BMP, TIFF, PGM or PPM");
  if (expected && (size->width != expected->width || size->height != expected->height))
    throw InputError(file, fmt::format("found {} px, expected {} {}", sides_text(size->width, size->height),
                                       sides_text(expected->width, expected->height), expected->as));
  if (std::int64_t{size->width} * size->height > kMostPixels)
    throw InputError(file, fmt::format("found {} px, expected at most {} megapixels",
                                       sides_text(size->width, size->height), kMostPixels / 1'000'000));
  if (bytes.starts_with("\xff\xd8") && !is_whole_jpeg(bytes))
    throw InputError(file, "is a JPEG that is cut short, expected a whole one: copy it from the camera again");
  cv::Mat image;
  try {
    image = cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data())), flags);
  } catch (const cv::Exception&) {
  }
  if (image.size() != *size) throw InputError(file, "cannot be decoded, expected an image that is whole");
  return image;
}

}  // namespace tankrig
