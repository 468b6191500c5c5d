// CRC-32 as in PNG, zlib and IEEE 802.3: it proves that a spooled frame or a chunk of a picture is whole.
#pragma once

#include <libdeflate.h>

#include <cstdint>
#include <string_view>

namespace tankrig {

/// Of `bytes`, or of `bytes` appended to what has the CRC `before`.
inline std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) {
  return libdeflate_crc32(before, bytes.data(), bytes.size());
}

}  // namespace tankrig
