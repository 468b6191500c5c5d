#include "session/reading/jpeg_file.hpp"

#include <cstddef>

namespace tankrig {

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

}  // namespace tankrig
