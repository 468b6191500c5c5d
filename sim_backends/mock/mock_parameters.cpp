#include "sim_backends/mock/mock_parameters.hpp"

#include <algorithm>

namespace tankrig::sim {
namespace {

constexpr ConfigRange kNotNegative{0, 1e6};
constexpr ConfigRange kPositive{1e-9, 1e6};

void read_joints(const ConfigNode& node, std::string_view key, std::array<double, kJoints>& into) {
  if (!node.has(key)) return;
  const auto values = node.numbers(key, kJoints);
  std::copy(values.begin(), values.end(), into.begin());
}

void read_arm(const ConfigNode& node, MockArmParameters& arm) {
  arm.exchange_period = node.milliseconds_or("exchange_period_ms", arm.exchange_period, {0.1, 1000});
  arm.feedback_latency = node.milliseconds_or("feedback_latency_ms", arm.feedback_latency, {0, 500});
  arm.latency_known = node.flag_or("latency_known", arm.latency_known);
  arm.watchdog = node.milliseconds_or("watchdog_ms", arm.watchdog, kPositive);
  arm.time_constant = node.number_or("time_constant_s", arm.time_constant, kPositive);
  arm.creep = node.number_or("creep_rad_s", arm.creep, kNotNegative);
  arm.max_ticks_per_s = node.number_or("max_ticks_per_s", arm.max_ticks_per_s, kPositive);
  if (node.has("dead_zone_rad_s")) {
    const auto values = node.numbers("dead_zone_rad_s", kJoints);
    for (int j = 0; j < kJoints; ++j) arm.dead_zone[j] = values[static_cast<std::size_t>(j)];
  }
  read_joints(node, "backlash_ticks", arm.backlash_ticks);
  read_joints(node, "stiction_ticks_per_s", arm.stiction_ticks_per_s);
  read_joints(node, "speed_gain", arm.speed_gain);
}

void read_camera(const ConfigNode& node, MockCameraParameters& camera) {
  camera.exposure = node.milliseconds_or("exposure_ms", camera.exposure, kPositive);
  camera.phase = node.milliseconds_or("phase_ms", camera.phase, kNotNegative);
  camera.readout = node.milliseconds_or("readout_ms", camera.readout, kNotNegative);
  camera.drop_every = node.integer_or("drop_every", camera.drop_every, {0, 1e6});
  camera.buffer_frames = node.integer_or("buffer_frames", camera.buffer_frames, {1, 1000});
  camera.trigger_delay = node.milliseconds_or("trigger_delay_ms", camera.trigger_delay, kNotNegative);
  camera.stamp_offset = node.milliseconds_or("stamp_offset_ms", camera.stamp_offset, {-1000, 1000});
}

}  // namespace

MockParameters parameters_from(const ConfigNode& mock) {
  MockParameters p;
  if (const auto arm = mock.optional_child("arm")) read_arm(*arm, p.arm);
  if (const auto camera = mock.optional_child("camera")) read_camera(*camera, p.camera);
  if (const auto laser = mock.optional_child("laser"))
    p.laser_warm_up = laser->milliseconds_or("warm_up_ms", p.laser_warm_up, kNotNegative);
  if (const auto lux = mock.optional_child("lux_meter"))
    p.lux_relative_noise = lux->number_or("relative_noise", p.lux_relative_noise, {0, 1});
  mock.finish();
  return p;
}

}  // namespace tankrig::sim
