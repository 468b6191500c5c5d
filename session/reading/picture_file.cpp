#include "session/reading/picture_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "core/jpeg_errors.hpp"
#include "core/picture_codecs.hpp"
#include "session/recording/png_file.hpp"

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

/// End of the pixels, where they are not compressed.
std::uint64_t bmp_end(std::string_view bmp) {
  constexpr std::uint32_t kOldHeader = 12, kPlain = 0, kBitFields = 3;
  const Bytes bytes{bmp, true};
  const bool old = bytes.u32(14) == kOldHeader;
  const std::uint32_t compression = old ? kPlain : bytes.u32(30);
  if (compression != kPlain && compression != kBitFields) return 0;
  const auto [width, height] = bmp_sides(bmp);
  const std::uint64_t row = (static_cast<std::uint64_t>(width) * bytes.u16(old ? 24 : 28) + 31) / 32 * 4;
  return bytes.u32(10) + row * static_cast<std::uint64_t>(height);
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

/// End of the last strip or tile of its first picture.
std::uint64_t tiff_end(std::string_view tiff) {
  constexpr std::uint32_t kOffsets[] = {273, 324}, kCounts[] = {279, 325}, kShort = 3;
  const Bytes bytes{tiff, tiff.starts_with('I')};
  const std::size_t directory = bytes.u32(4);
  struct List {
    std::size_t size = 0, at = 0, step = 4;
  } offsets, counts;
  for (std::size_t i = 0, entries = bytes.u16(directory); i < entries; ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    const std::uint32_t tag = bytes.u16(entry);
    const bool is_offsets = std::ranges::find(kOffsets, tag) != std::end(kOffsets);
    if (!is_offsets && std::ranges::find(kCounts, tag) == std::end(kCounts)) continue;
    List& list = is_offsets ? offsets : counts;
    list.step = bytes.u16(entry + 2) == kShort ? 2 : 4;
    list.size = bytes.u32(entry + 4);
    list.at = list.size * list.step <= 4 ? entry + 8 : bytes.u32(entry + 8);
  }
  const auto value = [&](const List& list, std::size_t i) {
    const std::size_t at = list.at + i * list.step;
    return std::uint64_t{list.step == 2 ? bytes.u16(at) : bytes.u32(at)};
  };
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < std::min({offsets.size, counts.size, tiff.size()}); ++i)
    end = std::max(end, value(offsets, i) + value(counts, i));
  return end;
}

/// The number at `at` in the header of a PBM, PGM or PPM, comments before it skipped; `at` moves behind it.
std::int64_t pnm_number(std::string_view pnm, std::size_t& at) {
  std::int64_t number = 0;
  while (at < pnm.size() && (std::isspace(static_cast<unsigned char>(pnm[at])) || pnm[at] == '#'))
    at = pnm[at] == '#' ? std::min(pnm.find('\n', at), pnm.size()) : at + 1;
  for (; at < pnm.size() && std::isdigit(static_cast<unsigned char>(pnm[at])) && number <= kMostPixels; ++at)
    number = 10 * number + (pnm[at] - '0');
  return number;
}

/// Of PBM, PGM and PPM: two numbers after the first two characters.
Sides pnm_sides(std::string_view pnm) {
  std::size_t at = 2;
  const std::int64_t width = pnm_number(pnm, at);
  return {width, pnm_number(pnm, at)};
}

/// End of the pixels, where they are binary.
std::uint64_t pnm_end(std::string_view pnm) {
  if (pnm[1] < '4') return 0;
  std::size_t at = 2;
  const auto width = static_cast<std::uint64_t>(pnm_number(pnm, at)),
             height = static_cast<std::uint64_t>(pnm_number(pnm, at));
  if (pnm[1] == '4') return at + 1 + (width + 7) / 8 * height;
  const std::uint64_t bytes_per_value = pnm_number(pnm, at) > 255 ? 2 : 1;
  return at + 1 + width * height * (pnm[1] == '6' ? 3 : 1) * bytes_per_value;
}

enum class Format { kUnknown, kPng, kJpeg, kBmp, kTiff, kPnm };

Format format_of(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return Format::kPng;
  if (bytes.starts_with("\xff\xd8\xff")) return Format::kJpeg;
  if (bytes.starts_with("BM")) return Format::kBmp;
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return Format::kTiff;
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') return Format::kPnm;
  return Format::kUnknown;
}

Sides sides_of(std::string_view bytes) {
  switch (format_of(bytes)) {
    case Format::kPng:
      return png_sides(bytes);
    case Format::kJpeg:
      return jpeg_sides(bytes);
    case Format::kBmp:
      return bmp_sides(bytes);
    case Format::kTiff:
      return tiff_sides(bytes);
    case Format::kPnm:
      return pnm_sides(bytes);
    case Format::kUnknown:
      break;
  }
  return {};
}

/// Whether libjpeg reads it without making anything up. Decoded at an eighth of the size, for the codes alone.
bool is_sound_jpeg(std::string_view bytes) {
  constexpr int kPadding = 8;  // bytes; webcams end a scan with a few
  JpegErrors errors{};
  jpeg_decompress_struct decoder{};
  errors.attach(decoder);
  jpeg_create_decompress(&decoder);
  // Nothing in here has a destructor: longjmp may leave it.
  const auto read = [](jpeg_decompress_struct& from, JpegErrors& complaints, std::string_view jpeg) {
    if (setjmp(complaints.give_up) != 0) return false;
    jpeg_mem_src(&from, reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size());
    if (jpeg_read_header(&from, TRUE) != JPEG_HEADER_OK) return false;
    from.scale_num = 1, from.scale_denom = 8;
    if (!jpeg_start_decompress(&from)) return false;
    JSAMPARRAY row = from.mem->alloc_sarray(reinterpret_cast<j_common_ptr>(&from), JPOOL_IMAGE,
                                            from.output_width * static_cast<JDIMENSION>(from.output_components), 1);
    while (from.output_scanline < from.output_height)
      if (jpeg_read_scanlines(&from, row, 1) != 1) return false;
    return static_cast<bool>(jpeg_finish_decompress(&from));
  };
  const bool all = read(decoder, errors, bytes);
  jpeg_destroy_decompress(&decoder);
  return all && !errors.damaged && errors.extraneous <= kPadding;
}

/// Refuses what a decoder might fill up on its own.
void check_whole(std::string_view bytes, const std::filesystem::path& file) {
  const auto check_end = [&](std::uint64_t end) {
    if (bytes.size() < end)
      throw DamagedPicture(file, fmt::format("is cut short: found {} bytes, expected {}", bytes.size(), end));
  };
  const char* copy_again = ": copy it from the camera again";
  switch (format_of(bytes)) {
    case Format::kPng:
      if (whole_png_size(bytes) == 0)
        throw DamagedPicture(file,
                             std::string("is a PNG that is cut short or damaged, expected a whole one") + copy_again);
      break;
    case Format::kJpeg:
      if (!is_whole_jpeg(bytes))
        throw DamagedPicture(file, std::string("is a JPEG that is cut short, expected a whole one") + copy_again);
      if (!is_sound_jpeg(bytes))
        throw DamagedPicture(file, std::string("is a JPEG that is damaged, expected a sound one") + copy_again);
      break;
    case Format::kBmp:
      check_end(bmp_end(bytes));
      break;
    case Format::kTiff:
      check_end(tiff_end(bytes));
      break;
    case Format::kPnm:
      check_end(pnm_end(bytes));
      break;
    case Format::kUnknown:
      break;
  }
}

/// Whether cv::imdecode with `flags` would give the picture as it is in its file.
bool fits(const cv::Mat& image, int flags) {
  constexpr int kHarmless =
      cv::IMREAD_COLOR | cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;
  if (image.empty()) return false;
  if (flags == cv::IMREAD_UNCHANGED) return true;
  if ((flags & ~kHarmless) != 0) return false;
  return (flags & cv::IMREAD_ANYCOLOR) != 0 || image.channels() == ((flags & cv::IMREAD_COLOR) != 0 ? 3 : 1);
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
  if (bytes.empty()) throw DamagedPicture(file, "is empty, expected an image");
  const auto size = picture_size(bytes);
  if (!size) throw DamagedPicture(file, "cannot be decoded, expected an image: PNG, JPEG, BMP, TIFF, PGM or PPM");
  if (expected && (size->width != expected->width || size->height != expected->height))
    throw InputError(file, fmt::format("found {} px, expected {} {}", sides_text(size->width, size->height),
                                       sides_text(expected->width, expected->height), expected->as));
  if (std::int64_t{size->width} * size->height > kMostPixels)
    throw InputError(file, fmt::format("found {} px, expected at most {} megapixels",
                                       sides_text(size->width, size->height), kMostPixels / 1'000'000));
  check_whole(bytes, file);
  cv::Mat image = decode_plain_png(bytes);
  if (fits(image, flags)) return image;
  image = decode_by_opencv(bytes, flags);
  if (image.size() != *size) throw DamagedPicture(file, "cannot be decoded, expected an image that is whole");
  return image;
}

}  // namespace tankrig
