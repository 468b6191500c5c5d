// The sensor's noise measured as a laboratory would.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "sim_backends/world/sensor_noise.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim {
namespace {

struct Statistics {
  double mean = 0, variance = 0, kurtosis = 0;
};

Statistics statistics(const std::vector<double>& x) {
  Statistics s;
  for (const double a : x) s.mean += a / static_cast<double>(x.size());
  double m4 = 0;
  for (const double a : x) {
    s.variance += std::pow(a - s.mean, 2) / static_cast<double>(x.size() - 1);
    m4 += std::pow(a - s.mean, 4) / static_cast<double>(x.size());
  }
  s.kurtosis = m4 / (s.variance * s.variance);
  return s;
}

CameraSpec camera(int channels = 3) {
  CameraSpec spec = testing::empty_scene().cameras[0];
  spec.channels = channels;
  return spec;
}

/// A flat field of `value` digital numbers.
std::vector<double> flat_field(const SensorNoise& sensor, const CameraSpec& spec, float value, std::uint64_t frame) {
  const int n = spec.model.width * spec.channels;
  const std::vector<float> in(n, value);
  std::vector<std::uint8_t> out(n);
  std::vector<double> all;
  for (int v = 0; v < spec.model.height; ++v) {
    sensor.digitise(frame, v, in.data(), out.data());
    all.insert(all.end(), out.begin(), out.end());
  }
  return all;
}

TEST(RenderSensor, AddsGaussianNoiseOfTheStatedShareOfFullScale) {
  CameraSpec spec = camera();
  for (const double sd : {0.01, 0.03, 0.10}) {
    spec.sensor.gaussian_sd = sd;
    const auto samples = flat_field(SensorNoise(spec, 1), spec, 127.25f, 3);
    const Statistics s = statistics(samples);
    EXPECT_NEAR(s.mean, 127.25, 4 * 255 * sd / std::sqrt(static_cast<double>(samples.size())));
    EXPECT_NEAR(std::sqrt(s.variance - 1 / 12.0), 255 * sd, 0.006 * 255 * sd);
    EXPECT_NEAR(s.kurtosis, 3, 0.04);
  }
}

TEST(RenderSensor, RoundsToTheNearestNumberWithoutNoise) {
  const CameraSpec spec = camera(1);
  const SensorNoise sut(spec, 1);
  EXPECT_EQ(flat_field(sut, spec, 100.4f, 0)[0], 100);
  EXPECT_EQ(flat_field(sut, spec, 100.6f, 0)[0], 101);
  EXPECT_EQ(flat_field(sut, spec, 900.0f, 0)[0], 255);
  EXPECT_EQ(flat_field(sut, spec, -3.0f, 0)[0], 0);
}

TEST(RenderSensor, ShowsThePhotonTransferSlopeOfItsGain) {
  CameraSpec spec = camera();
  spec.sensor.model = Sensor::Model::kEmva1288;
  spec.sensor.full_well_e = 2000;
  const SensorNoise sut(spec, 1);
  const double gain = 255 / spec.sensor.full_well_e;
  // Temporal variance from pairs of frames, which removes the fixed pattern.
  const auto point = [&](float value) {
    const auto a = flat_field(sut, spec, value, 10), b = flat_field(sut, spec, value, 11);
    std::vector<double> difference(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) difference[i] = a[i] - b[i];
    return std::pair{statistics(a).mean, statistics(difference).variance / 2};
  };
  const auto [low_mean, low_variance] = point(40);
  const auto [high_mean, high_variance] = point(160);
  EXPECT_NEAR((high_variance - low_variance) / (high_mean - low_mean), gain, 0.02 * gain);
  const double electrons = 40 / gain + spec.sensor.dark_e;
  EXPECT_NEAR(low_variance, gain * gain * (electrons + std::pow(spec.sensor.read_noise_e, 2)) + 1 / 12.0,
              0.02 * low_variance);
  EXPECT_NEAR(low_mean, 40 + gain * spec.sensor.dark_e, 0.05);
}

TEST(RenderSensor, RepeatsItsFixedPatternInEveryFrame) {
  CameraSpec spec = camera(1);
  spec.sensor = {Sensor::Model::kEmva1288, 0, 0, 1e7, 0, 0.02, 0};
  const SensorNoise sut(spec, 1);
  const auto a = flat_field(sut, spec, 200, 1), b = flat_field(sut, spec, 200, 2);
  EXPECT_NEAR(std::sqrt(statistics(a).variance), 4, 0.1);
  double product = 0;
  for (std::size_t i = 0; i < a.size(); ++i) product += (a[i] - 200) * (b[i] - 200) / static_cast<double>(a.size());
  EXPECT_GT(product / statistics(a).variance, 0.97);
}

TEST(RenderSensor, DiffersByFrameCameraSeedAndChannel) {
  CameraSpec spec = camera();
  spec.sensor.gaussian_sd = 0.05;
  const SensorNoise sut(spec, 1);
  const auto reference = flat_field(sut, spec, 100, 7);
  EXPECT_EQ(reference, flat_field(sut, spec, 100, 7));
  const auto correlation = [&](const std::vector<double>& other) {
    double product = 0;
    for (std::size_t i = 0; i < other.size(); ++i) product += (reference[i] - 100) * (other[i] - 100);
    return product / static_cast<double>(other.size()) / statistics(reference).variance;
  };
  EXPECT_NEAR(correlation(flat_field(sut, spec, 100, 8)), 0, 0.01);
  EXPECT_NEAR(correlation(flat_field(SensorNoise(spec, 2), spec, 100, 7)), 0, 0.01);
  spec.name = "other";
  EXPECT_NEAR(correlation(flat_field(SensorNoise(spec, 1), spec, 100, 7)), 0, 0.01);
  std::vector<double> next_channel(reference.begin() + 1, reference.end());
  EXPECT_NEAR(correlation(next_channel), 0, 0.01);
}

TEST(RenderSensor, RepeatsNothingAlongARow) {
  CameraSpec noisy = camera(1), patterned = camera(1);
  noisy.sensor.gaussian_sd = 0.05;
  patterned.sensor = {Sensor::Model::kEmva1288, 0, 0, 1e7, 0, 0.05, 0};
  for (const CameraSpec& spec : {noisy, patterned}) {
    const int width = spec.model.width, height = spec.model.height;
    const auto field = flat_field(SensorNoise(spec, 1), spec, 128, 1);
    const double variance = statistics(field).variance;
    for (int apart = 1; apart < width - 20; ++apart) {
      double product = 0;
      for (int v = 0; v < height; ++v)
        for (int u = 0; u + apart < width; ++u)
          product += (field[v * width + u] - 128) * (field[v * width + u + apart] - 128);
      const double pairs = height * (width - apart);
      EXPECT_NEAR(product / pairs / variance, 0, 5 / std::sqrt(pairs)) << apart << " pixels apart";
    }
  }
}

}  // namespace
}  // namespace tankrig::sim
