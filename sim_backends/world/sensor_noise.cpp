// Both noise models, one row at a time.
#include "sim_backends/world/sensor_noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::sim {
namespace {

std::uint8_t round_and_clip(float x) {
  return static_cast<std::uint8_t>(static_cast<int>(std::min(std::max(x, 0.0f), 255.0f) + 0.5f));
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
  const GaussianTable& gaussian = GaussianTable::instance();
  const std::uint64_t row = mix(mix(key_, frame), static_cast<std::uint64_t>(v));
  const auto sd = static_cast<float>(255 * gaussian_sd);
  const auto full_well = static_cast<float>(sensor_.full_well_e), dark = static_cast<float>(sensor_.dark_e);
  const auto read =
      static_cast<float>(sensor_.read_noise_e * sensor_.read_noise_e + std::pow(gaussian_sd * sensor_.full_well_e, 2));
  const float to_dn = 255 / full_well, to_e = full_well / 255;
  const float* gain = emva ? gain_.data() + static_cast<std::size_t>(v) * n : nullptr;
  for (int u = 0; u < width_; ++u) {
    std::uint64_t bits = mix(row + static_cast<std::uint64_t>(u));
    for (int i = u * channels_; i < (u + 1) * channels_; ++i, bits >>= GaussianTable::kBits) {
      if (emva) {
        const float electrons = in[i] * to_e;
        const float variance = std::max(electrons + dark, 0.0f) + read;
        out[i] = round_and_clip(to_dn * (electrons * gain[i] + dark + std::sqrt(variance) * gaussian(bits)));
      } else {
        out[i] = round_and_clip(in[i] + sd * gaussian(bits));
      }
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
