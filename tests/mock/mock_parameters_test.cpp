#include "sim_backends/mock/mock_parameters.hpp"

#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

MockParameters read(const std::string& yaml) {
  const TemporaryFolder folder;
  return settings_from(ConfigNode::load(folder.write("mock.yaml", yaml)), kMockKeys);
}

TEST(MockParameters, KeepDefaultsForWhatIsNotThere) {
  const MockParameters p = read("camera: {readout_ms: 12}\n");
  EXPECT_EQ(p.camera.readout, 12ms);
  EXPECT_EQ(p.camera.exposure, 10ms);
  EXPECT_EQ(p.arm.exchange_period, 10ms);
  EXPECT_EQ(p.laser_warm_up, 1s);
}

TEST(MockParameters, ReadEverySection) {
  const MockParameters p = read(
      "arm: {exchange_period_ms: 20, feedback_latency_ms: 2.5, latency_known: false, watchdog_ms: 400,\n"
      "      time_constant_s: 0.02, creep_rad_s: 0.02, dead_zone_rad_s: [0.1, 0.2, 0.3, 0.4, 0.5],\n"
      "      max_ticks_per_s: 1000, backlash_ticks: [1, 2, 3, 4, 5]}\n"
      "camera: {exposure_ms: 5, phase_ms: 1, readout_ms: 3, drop_every: 7, buffer_frames: 2}\n"
      "laser: {warm_up_ms: 250}\nlux_meter: {relative_noise: 0.01}\n");
  EXPECT_EQ(p.arm.exchange_period, 20ms);
  EXPECT_EQ(p.arm.feedback_latency, 2500us);
  EXPECT_FALSE(p.arm.latency_known);
  EXPECT_EQ(p.arm.watchdog, 400ms);
  EXPECT_EQ(p.arm.dead_zone[kJawOpening], 0.5);
  EXPECT_EQ(p.arm.backlash_ticks[kElbow], 3);
  EXPECT_EQ(p.camera.drop_every, 7);
  EXPECT_EQ(p.laser_warm_up, 250ms);
  EXPECT_EQ(p.lux_relative_noise, 0.01);
}

TEST(MockParameters, RefuseUnknownKeysAndValuesOutOfRange) {
  EXPECT_THROW(read("arm: {exchange_period: 20}\n"), InputError);
  EXPECT_THROW(read("camera: {exposure_ms: 0}\n"), InputError);
  EXPECT_THROW(read("motor: {}\n"), InputError);
}

}  // namespace
}  // namespace tankrig::sim
