#include "session/checking/crc32.hpp"

#include <array>
#include <cstring>

namespace tankrig {
namespace {

using Tables = std::array<std::array<std::uint32_t, 256>, 8>;

/// Table k: what a byte does to the remainder k bytes later.
constexpr Tables make_tables() {
  Tables t{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = c & 1 ? 0xedb88320U ^ c >> 1 : c >> 1;
    t[0][i] = c;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t i = 0; i < 256; ++i) t[k][i] = t[0][t[k - 1][i] & 0xff] ^ t[k - 1][i] >> 8;
  return t;
}

constexpr Tables kTables = make_tables();

std::uint32_t little_endian(const unsigned char* p) {
  return std::uint32_t{p[0]} | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 | std::uint32_t{p[3]} << 24;
}

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  const auto* p = reinterpret_cast<const unsigned char*>(bytes.data());
  std::size_t left = bytes.size();
  std::uint32_t c = ~before;
  for (; left >= 8; p += 8, left -= 8) {
    const std::uint32_t a = little_endian(p) ^ c, b = little_endian(p + 4);
    c = kTables[7][a & 0xff] ^ kTables[6][a >> 8 & 0xff] ^ kTables[5][a >> 16 & 0xff] ^ kTables[4][a >> 24] ^
        kTables[3][b & 0xff] ^ kTables[2][b >> 8 & 0xff] ^ kTables[1][b >> 16 & 0xff] ^ kTables[0][b >> 24];
  }
  for (; left > 0; ++p, --left) c = kTables[0][(c ^ *p) & 0xff] ^ c >> 8;
  return ~c;
}

}  // namespace tankrig
