// CRC-32 as in PNG, zlib and IEEE 802.3: how a frame in the spool and a chunk of a picture prove that they are whole.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string_view>

namespace tankrig {

/// Of `bytes`, or of what `before` is the CRC of followed by `bytes`.
inline std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace tankrig
