// Both noise models, one row at a time.
#include "sim_backends/world/sensor_noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::sim {
namespace {

constexpr int kBlock = 256;  // pixels whose values stay in the first cache

/// Without a branch: what is black without noise falls below 0 every second time.
std::uint8_t round_and_clip(float x) {
  constexpr float kBeyond = 300;  // more than white, and fits an int
  const int rounded = static_cast<int>(std::min(x, kBeyond) + 0.5f);
  return static_cast<std::uint8_t>(std::clamp(rounded, 0, 255));
}

/// Standard normal numbers of pixels [first, last) of a row.
void fill_gaussians(std::uint64_t row, int first, int last, int channels, float* out) {
  const GaussianTable& gaussian = GaussianTable::instance();
  for (int u = first; u < last; ++u) {
    std::uint64_t bits = mix(row + static_cast<std::uint64_t>(u));
    for (int c = 0; c < channels; ++c, bits >>= GaussianTable::kBits) *out++ = gaussian(bits);
  }
}

}  // namespace

SensorNoise::SensorNoise(const CameraSpec& spec, std::uint64_t seed)
    : sensor_(spec.sensor),
      width_(spec.model.width),
      channels_(spec.channels),
      key_(mix(mix(seed, hash_text("noise")), hash_text(spec.name))) {
  if (sensor_.model != Sensor::Model::kEmva1288) return;
  const GaussianTable& gaussian = GaussianTable::instance();
  const std::uint64_t key = mix(key_, hash_text("prnu"));
  gain_.resize(static_cast<std::size_t>(width_) * spec.model.height * channels_);
  for (std::size_t i = 0; i < gain_.size(); ++i)
    gain_[i] = 1 + static_cast<float>(sensor_.prnu) * gaussian(mix(key, i));
}

void SensorNoise::digitise(std::uint64_t frame, int v, double gaussian_sd, const float* in, std::uint8_t* out) const {
  const int n = width_ * channels_;
  const bool emva = sensor_.model == Sensor::Model::kEmva1288;
  if (!emva && gaussian_sd <= 0) {
    for (int i = 0; i < n; ++i) out[i] = round_and_clip(in[i]);
    return;
  }
  const std::uint64_t row = mix(mix(key_, frame), static_cast<std::uint64_t>(v));
  const auto sd = static_cast<float>(255 * gaussian_sd);
  const auto full_well = static_cast<float>(sensor_.full_well_e), dark = static_cast<float>(sensor_.dark_e);
  const auto read =
      static_cast<float>(sensor_.read_noise_e * sensor_.read_noise_e + std::pow(gaussian_sd * sensor_.full_well_e, 2));
  const float to_dn = 255 / full_well, to_e = full_well / 255;
  const float* gain = emva ? gain_.data() + static_cast<std::size_t>(v) * n : nullptr;
  float g[3 * kBlock];
  for (int u = 0; u < width_; u += kBlock) {
    const int end = std::min(u + kBlock, width_), first = u * channels_, count = (end - u) * channels_;
    fill_gaussians(row, u, end, channels_, g);
    const float* here = in + first;
    std::uint8_t* to = out + first;
    if (emva) {
      for (int i = 0; i < count; ++i) {
        const float electrons = here[i] * to_e, lit = electrons + dark, variance = (lit < 0 ? 0 : lit) + read;
        to[i] = round_and_clip(to_dn * (electrons * gain[first + i] + dark + std::sqrt(variance) * g[i]));
      }
    } else {
      for (int i = 0; i < count; ++i) to[i] = round_and_clip(here[i] + sd * g[i]);
    }
  }
}

std::string describe(const Sensor& sensor) {
  if (sensor.model != Sensor::Model::kEmva1288)
    return fmt::format("gaussian: additive sd {:g} of full scale", sensor.gaussian_sd);
  return fmt::format(
      "emva1288: full well {:g} e-, read noise {:g} e-, PRNU {:g}, dark signal {:g} e-, additive sd {:g} of full scale",
      sensor.full_well_e, sensor.read_noise_e, sensor.prnu, sensor.dark_e, sensor.gaussian_sd);
}

}  // namespace tankrig::sim
