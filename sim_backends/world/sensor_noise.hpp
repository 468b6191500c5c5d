// From light to numbers: the sensor's noise and quantisation.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {

/// Models:
///   kGaussian  y = x + 255 sd g, the paper's and UWSim's additive noise
///   kEmva1288  y = K (n (1 + prnu h) + mu_d + sqrt(n + mu_d + sigma_d^2 + (sd full_well)^2) g), n = x / K,
///              K = 255 / full_well
/// then rounded and clipped to 0 .. 255. g and h are standard normal; h belongs to the pixel, g to pixel and frame.
/// Shot noise is taken in its normal limit. A sample depends only on seed, camera, frame, pixel and channel.
/// Source: EMVA Standard 1288, release 3.1, linear model.
class SensorNoise {
 public:
  SensorNoise(const CameraSpec& spec, std::uint64_t seed);

  /// Row `v` of frame `frame`: `in` digital numbers without noise, `out` 8 bit; width * channels of each.
  void digitise(std::uint64_t frame, int v, const float* in, std::uint8_t* out) const {
    digitise(frame, v, sensor_.gaussian_sd, in, out);
  }
  /// With `gaussian_sd` in place of the sensor's.
  void digitise(std::uint64_t frame, int v, double gaussian_sd, const float* in, std::uint8_t* out) const;

 private:
  Sensor sensor_;
  int width_, channels_;
  std::uint64_t key_;
  std::vector<float> gain_;  ///< 1 + prnu h, per pixel; EMVA only
};

/// Model and parameters in one line, for the session.
std::string describe(const Sensor& sensor);

}  // namespace tankrig::sim
