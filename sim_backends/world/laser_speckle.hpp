// Speckle of the laser's light: a multiplicative pattern one to two pixels coarse, new in every frame.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::sim {

/// Factors of mean 1 and standard deviation `contrast` for a square of N x N pixels, gamma distributed as integrated
/// speckle is. A pixel's factor depends only on the key and the pixel.
/// Source: J. W. Goodman, Speckle Phenomena in Optics, 2007; the gamma variate by Wilson and Hilferty's cube.
template <int N>
class SpeckleTile {
 public:
  SpeckleTile(std::uint64_t key, int left, int top, float contrast) {
    if (contrast <= 0) {
      factor_.fill(1);
      return;
    }
    const GaussianTable& gaussian = GaussianTable::instance();
    constexpr int kWide = N + 2;
    std::array<float, kWide * kWide> white;
    for (int y = 0; y < kWide; ++y)
      for (int x = 0; x < kWide; ++x) {
        const auto pixel = (static_cast<std::uint64_t>(top + y) << 32) + static_cast<std::uint64_t>(left + x);
        white[y * kWide + x] = gaussian(mix(key + pixel * 0xd1342543de82ef95u));
      }
    const float k = 1 / (contrast * contrast), shift = 1 - 1 / (9 * k), slope = 1 / (3 * std::sqrt(k));
    for (int y = 0; y < N; ++y)
      for (int x = 0; x < N; ++x) {
        const float* w = white.data() + y * kWide + x;
        const float* w1 = w + kWide;
        const float* w2 = w1 + kWide;
        // Binomial smoothing; its weights' squares sum to (3/8)^2.
        const float smooth = (w[0] + 2 * w[1] + w[2] + 2 * (w1[0] + 2 * w1[1] + w1[2]) + w2[0] + 2 * w2[1] + w2[2]) / 6;
        const float root = std::max(0.0f, shift + slope * smooth);
        factor_[y * N + x] = root * root * root;
      }
  }

  float at(int x, int y) const { return factor_[y * N + x]; }

 private:
  std::array<float, N * N> factor_;
};

}  // namespace tankrig::sim
