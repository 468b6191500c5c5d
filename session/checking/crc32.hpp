// CRC-32 as in PNG, zlib and IEEE 802.3: how a frame in the spool and a chunk of a picture prove that they are whole.
#pragma once

#include <cstdint>
#include <string_view>

namespace tankrig {

/// Of `bytes`, or of what `before` is the CRC of followed by `bytes`. Some GB/s: eight bytes a step.
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace tankrig
