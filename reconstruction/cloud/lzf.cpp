#include "reconstruction/cloud/lzf.hpp"

namespace tankrig::cloud_file {

std::optional<std::string> lzf_unpack(std::string_view packed, std::size_t size) {
  constexpr std::size_t kMaxRatio = 264;
  if (size / kMaxRatio > packed.size()) return std::nullopt;
  std::string out;
  out.reserve(size);
  std::size_t at = 0;
  const auto byte = [&] { return static_cast<unsigned char>(packed[at++]); };
  while (at < packed.size()) {
    const unsigned control = byte();
    if (control < 32) {
      const std::size_t length = control + 1;
      if (packed.size() - at < length || size - out.size() < length) return std::nullopt;
      out.append(packed.substr(at, length));
      at += length;
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7) {
      if (at == packed.size()) return std::nullopt;
      length += byte();
    }
    length += 2;
    if (at == packed.size()) return std::nullopt;
    const std::size_t back = ((control & 31u) << 8) + byte() + 1;
    if (back > out.size() || size - out.size() < length) return std::nullopt;
    for (std::size_t i = 0; i < length; ++i) out.push_back(out[out.size() - back]);
  }
  if (out.size() != size) return std::nullopt;
  return out;
}

}  // namespace tankrig::cloud_file
