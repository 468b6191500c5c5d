#include "session/recording/png_file.hpp"

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/input_error.hpp"
#include "session/checking/crc32.hpp"

namespace tankrig {
namespace {

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[static_cast<std::size_t>(i)]);
  return value;
}

}  // namespace

std::string png_of(const cv::Mat& image, const std::filesystem::path& file) {
  std::vector<unsigned char> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY});
  } catch (const cv::Exception&) {
  }
  if (!encoded) throw InputError(file, "cannot be encoded, expected an image of 8 bits and 1 or 3 channels");
  return {bytes.begin(), bytes.end()};
}

std::size_t whole_png_size(std::string_view bytes) {
  constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
  constexpr std::size_t kAround = 12;  // length, type and CRC of a chunk
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
