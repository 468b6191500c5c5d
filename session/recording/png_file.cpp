#include "session/recording/png_file.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/input_error.hpp"
#include "session/checking/crc32.hpp"

namespace tankrig {
namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::size_t kAround = 12;                                               // length, type and CRC of a chunk
constexpr int kFastest = 1;                                                       // libdeflate's level
constexpr std::size_t kHeader = 13;                                               // bytes of IHDR
constexpr std::string_view kGrey("\x08\0\0\0\0", 5), kColour("\x08\2\0\0\0", 5);  // 8 bits, not interlaced

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[static_cast<std::size_t>(i)]);
  return value;
}

std::string big_endian_bytes(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

void append_chunk(std::string& png, std::string_view type, std::string_view data) {
  png += big_endian_bytes(static_cast<std::uint32_t>(data.size()));
  const std::size_t checked = png.size();
  png.append(type).append(data);
  png += big_endian_bytes(crc32(std::string_view(png).substr(checked)));
}

/// A picture's rows as PNG has them: a byte for the filter before each, channels as red, green, blue. The bytes are a
/// thread's own and used again: fresh pages cost as much as what is done to them.
/// Threads: one such object in each at a time.
struct Rows {
  int width, height, channels;
  std::vector<unsigned char>& bytes;

  Rows(int w, int h, int c) : width(w), height(h), channels(c), bytes(kept()) {
    if (bytes.size() < size()) bytes.resize(size());
  }
  ~Rows() {
    constexpr std::size_t kMostKept = 32 << 20;
    if (bytes.size() > kMostKept) std::vector<unsigned char>().swap(bytes);
  }
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;

  std::size_t stride() const { return 1 + row_size(); }
  std::size_t row_size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels); }
  std::size_t size() const { return stride() * static_cast<std::size_t>(height); }
  unsigned char* row(int y) { return bytes.data() + stride() * static_cast<std::size_t>(y) + 1; }

 private:
  static std::vector<unsigned char>& kept() {
    thread_local std::vector<unsigned char> bytes;
    return bytes;
  }
};

/// Between OpenCV's order of channels and PNG's.
void copy_row(const unsigned char* __restrict from, int width, int channels, unsigned char* __restrict to) {
  if (channels == 1) {
    std::copy(from, from + width, to);
    return;
  }
  for (int x = 0; x < width; ++x) {
    to[3 * x] = from[3 * x + 2];
    to[3 * x + 1] = from[3 * x + 1];
    to[3 * x + 2] = from[3 * x];
  }
}

int paeth(int left, int above, int corner) {
  const int to_left = std::abs(above - corner), to_above = std::abs(left - corner);
  const int to_corner = std::abs(left + above - 2 * corner);
  if (to_left <= to_above && to_left <= to_corner) return left;
  return to_above <= to_corner ? above : corner;
}

/// Undoes the filters of PNG's section 9, row by row; false if a row states one that does not exist.
bool unfilter(Rows& rows) {
  const std::size_t pixel = static_cast<std::size_t>(rows.channels), size = rows.row_size();
  const std::vector<unsigned char> none(size);
  const unsigned char* above = none.data();
  for (int y = 0; y < rows.height; ++y) {
    unsigned char* row = rows.row(y);
    const auto add = [&](const auto& predicted) {
      for (std::size_t i = 0; i < size; ++i) {
        const int left = i < pixel ? 0 : row[i - pixel], corner = i < pixel ? 0 : above[i - pixel];
        row[i] = static_cast<unsigned char>(row[i] + predicted(left, static_cast<int>(above[i]), corner));
      }
    };
    switch (row[-1]) {
      case 0:
        break;
      case 1:
        add([](int left, int, int) { return left; });
        break;
      case 2:
        add([](int, int up, int) { return up; });
        break;
      case 3:
        add([](int left, int up, int) { return (left + up) / 2; });
        break;
      case 4:
        add(paeth);
        break;
      default:
        return false;
    }
    above = row;
  }
  return true;
}

using Compressor = std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)>;
using Decompressor = std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>;

}  // namespace

std::string png_of(const cv::Mat& image, const std::filesystem::path& file) {
  if (image.empty() || (image.type() != CV_8UC1 && image.type() != CV_8UC3))
    throw InputError(file, "cannot be encoded, expected an image of 8 bits and 1 or 3 channels");
  Rows rows(image.cols, image.rows, image.channels());
  constexpr unsigned char kNoFilter = 0;
  for (int y = 0; y < rows.height; ++y) {
    rows.row(y)[-1] = kNoFilter;
    copy_row(image.ptr(y), rows.width, rows.channels, rows.row(y));
  }
  thread_local const Compressor compressor(libdeflate_alloc_compressor(kFastest), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string data(libdeflate_zlib_compress_bound(compressor.get(), rows.size()), '\0');
  data.resize(libdeflate_zlib_compress(compressor.get(), rows.bytes.data(), rows.size(), data.data(), data.size()));

  std::string header = big_endian_bytes(static_cast<std::uint32_t>(image.cols)) +
                       big_endian_bytes(static_cast<std::uint32_t>(image.rows));
  header += image.channels() == 1 ? kGrey : kColour;
  std::string png(kSignature);
  png.reserve(kSignature.size() + 3 * kAround + kHeader + data.size());
  append_chunk(png, "IHDR", header);
  append_chunk(png, "IDAT", data);
  append_chunk(png, "IEND", {});
  return png;
}

cv::Mat decode_plain_png(std::string_view png) {
  std::string_view header;
  std::string joined;
  std::string_view data;
  if (!png.starts_with(kSignature)) return {};
  for (std::size_t at = kSignature.size(); at < png.size();) {
    if (png.size() - at < kAround) return {};
    const std::size_t length = big_endian(png.substr(at));
    if (length > png.size() - at - kAround) return {};
    const std::string_view type = png.substr(at + 4, 4), content = png.substr(at + 8, length);
    at += kAround + length;
    if (type == "IHDR" && length == kHeader && header.empty()) {
      header = content;
    } else if (type == "IDAT") {
      if (data.empty()) {
        data = content;
      } else {
        if (joined.empty()) joined = data;
        data = joined.append(content);
      }
    } else if (type != "IEND") {
      return {};
    }
  }
  const std::string_view kind = header.empty() ? header : header.substr(8);
  const bool grey = kind == kGrey;
  if (!grey && kind != kColour) return {};
  constexpr std::uint32_t kMostSide = 1 << 24;
  const std::uint32_t width = big_endian(header), height = big_endian(header.substr(4));
  constexpr std::uint64_t kMostRatio = 1032;  // of deflate
  const std::uint64_t expected = (1 + std::uint64_t{width} * (grey ? 1 : 3)) * height;
  if (width == 0 || height == 0 || width > kMostSide || height > kMostSide || expected > kMostRatio * data.size())
    return {};

  Rows rows(static_cast<int>(width), static_cast<int>(height), grey ? 1 : 3);
  thread_local const Decompressor decompressor(libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  const auto result =
      libdeflate_zlib_decompress(decompressor.get(), data.data(), data.size(), rows.bytes.data(), rows.size(), nullptr);
  if (result != LIBDEFLATE_SUCCESS || !unfilter(rows)) return {};
  cv::Mat image(rows.height, rows.width, CV_8UC(rows.channels));
  for (int y = 0; y < rows.height; ++y) copy_row(rows.row(y), rows.width, rows.channels, image.ptr(y));
  return image;
}

std::size_t whole_png_size(std::string_view bytes) {
  if (!bytes.starts_with(kSignature)) return 0;
  std::size_t at = kSignature.size();
  while (bytes.size() - at >= kAround) {
    const std::size_t length = big_endian(bytes.substr(at));
    if (length > bytes.size() - at - kAround) return 0;
    const std::string_view checked = bytes.substr(at + 4, 4 + length);
    if (crc32(checked) != big_endian(bytes.substr(at + 8 + length))) return 0;
    at += kAround + length;
    if (checked.starts_with("IEND")) return at;
  }
  return 0;
}

bool is_whole_png(std::string_view bytes) { return !bytes.empty() && whole_png_size(bytes) == bytes.size(); }

}  // namespace tankrig
