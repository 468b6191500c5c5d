// Value noise, lettering, stripes and scratches.
#include "sim_backends/world/surface_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace tankrig::sim {
namespace {

std::uint32_t lattice_hash(int x, int y, int z) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ static_cast<std::uint32_t>(y) * 0xd8163841u ^
                    static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return h ^ (h >> 15);
}

float lattice_value(int x, int y, int z) { return static_cast<float>(lattice_hash(x, y, z) >> 8) * 0x1p-24f; }

int floor_int(float x) {
  const int i = static_cast<int>(x);
  return i - (x < static_cast<float>(i) ? 1 : 0);
}

/// A cell of the unit lattice. In what has four values the last of a place is nought.
struct LatticeCell {
  Eigen::Array4f corner;     ///< the lowest
  Eigen::Array4f low, high;  ///< what its edges along x have at their ends: y fastest, then z

  explicit LatticeCell(const Eigen::Array4f& lowest = Eigen::Array4f::Zero()) : corner(lowest) {
    const Eigen::Array4i at = lowest.cast<int>();
    std::array<float, 8> value;
    for (int k = 0; k < 8; ++k) value[k] = lattice_value(at[0] + k / 4, at[1] + k % 2, at[2] + k / 2 % 2);
    low = Eigen::Array4f::Map(value.data());
    high = Eigen::Array4f::Map(value.data() + 4);
  }
};

/// Value noise in [-1, 1] on a unit lattice; `cell` is the one met last, for places beside each other share it.
float value_noise(const Eigen::Array4f& p, LatticeCell& cell) {
  const Eigen::Array4f corner = p.floor();
  if (std::memcmp(corner.data(), cell.corner.data(), sizeof corner) != 0) cell = LatticeCell(corner);
  const Eigen::Array4f t = p - corner, share = t * t * (3 - 2 * t);
  const Eigen::Array4f edge = cell.low + share[0] * (cell.high - cell.low);
  const float a = edge[0] + share[1] * (edge[1] - edge[0]), b = edge[2] + share[1] * (edge[3] - edge[2]);
  return 2 * (a + share[2] * (b - a)) - 1;
}

constexpr int kOctaves = 3;

/// Octaves of value noise at grain sizes scale, scale / 2, ...; about [-1, 1].
float grain(const Eigen::Vector3f& p, float scale) {
  thread_local std::array<LatticeCell, kOctaves> cells;
  const Eigen::Array4f place(p.x(), p.y(), p.z(), 0);
  const Eigen::Array4f shift(17.3f, -17.3f, 17.3f, 0);
  float sum = 0, frequency = 1 / scale, amplitude = 1;
  for (int i = 0; i < kOctaves; ++i) {
    sum += amplitude * value_noise(place * frequency + shift * static_cast<float>(i + 1), cells[i]);
    frequency *= 2;
    amplitude *= 0.75f;
  }
  return sum * 0.75f;
}

float wrap(float x, float period) { return x - period * static_cast<float>(floor_int(x / period)); }

/// 1 on the strokes of rows of seven-segment-like letters, 0 beside them.
float lettering(float u, float v, int face) {
  constexpr float kLine = 0.034f, kLetter = 0.013f, kWide = 0.009f, kHigh = 0.020f, kStroke = 0.0026f;
  const int row = floor_int(v / kLine), column = floor_int(u / kLetter);
  const float x = u - kLetter * static_cast<float>(column), y = v - kLine * static_cast<float>(row);
  if (x > kWide || y > kHigh) return 0;
  const std::uint32_t letter = lattice_hash(column, row, 101 + face);
  if ((letter & 7) == 0) return 0;
  const auto near = [&](float distance) { return std::abs(distance) < kStroke / 2; };
  const float mid = kHigh / 2;
  if ((letter & 8) && near(y - kStroke / 2)) return 1;
  if ((letter & 16) && near(y - mid)) return 1;
  if ((letter & 32) && near(y - kHigh + kStroke / 2)) return 1;
  if ((letter & 64) && near(x - kStroke / 2)) return 1;
  if (((letter & 128) || !(letter & 64)) && near(x - kWide + kStroke / 2)) return 1;
  return 0;
}

/// Thin bright lines at random places and angles, one per cell at most.
float scratches(float u, float v, int face) {
  constexpr float kCell = 0.045f;
  const int i = floor_int(u / kCell), j = floor_int(v / kCell);
  const std::uint32_t h = lattice_hash(i, j, 211 + face);
  if (h & 1) return 0;
  const float x = u / kCell - static_cast<float>(i) - 0.5f, y = v / kCell - static_cast<float>(j) - 0.5f;
  const float angle = static_cast<float>((h >> 1) & 1023) * (3.14159265f / 1024);
  const float offset = (static_cast<float>((h >> 11) & 255) / 255 - 0.5f) * 0.6f;
  const float across = x * std::cos(angle) + y * std::sin(angle) - offset;
  return std::abs(across) < 0.016f ? 1.0f : 0.0f;
}

/// Relative brightness of the mock-up box: grain everywhere, labels and wear on each face, in [-1, 1.5] or so.
float labels(const Eigen::Vector3f& p, const Eigen::Vector3f& n, float scale) {
  const Eigen::Vector3f a = n.cwiseAbs();
  const int axis = a.x() > a.y() ? (a.x() > a.z() ? 0 : 2) : (a.y() > a.z() ? 1 : 2);
  const int face = 2 * axis + (n[axis] > 0 ? 1 : 0);
  const float u = axis == 0 ? p.y() : p.x(), v = axis == 2 ? p.y() : p.z();
  float value = 0.75f * grain(p, scale) - 0.12f;
  const float panel = wrap(v + 0.011f * static_cast<float>(face), 0.102f);
  if (panel < 0.060f)
    value += 1.1f * lettering(u, v, face);
  else if (panel > 0.078f && panel < 0.092f)
    value += wrap(u + v, 0.030f) < 0.015f ? 0.7f : -0.3f;
  return value + 0.6f * scratches(u, v, face);
}

}  // namespace

Rgb texture_albedo(const Material& material, const Eigen::Vector3f& p, const Eigen::Vector3f& normal) {
  const auto scale = static_cast<float>(material.scale);
  float relative = 0;
  if (material.texture == Material::Texture::kSpeckle) relative = grain(p, scale);
  if (material.texture == Material::Texture::kLabels) relative = labels(p, normal, scale);
  const float factor = std::clamp(1 + material.contrast * relative, 0.15f, 2.5f);
  return (material.albedo * factor).min(0.95f);
}

}  // namespace tankrig::sim
