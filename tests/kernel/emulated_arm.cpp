#include "tests/kernel/emulated_arm.hpp"

#include <chrono>
#include <cmath>
#include <stdexcept>

#include "tests/kernel/guest.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kElbowSpeed = 0.15;  // rad/s, above the axis' stiction

JointVector elbow_at(double speed) {
  JointVector velocity = JointVector::Zero();
  velocity[kElbow] = speed;
  return velocity;
}

sim::ArmEmulatorParameters emulator_of(int bitrate) {
  sim::ArmEmulatorParameters parameters;
  parameters.can_bitrate = bitrate;
  parameters.watchdog = Duration{0};  // none is known of the real arm
  return parameters;
}

}  // namespace

Arm5eSettings guest_arm_settings() {
  Arm5eSettings settings;
  settings.exchange_rate_hz = 50;
  settings.reply_timeout = milliseconds(100);
  settings.silence_timeout = milliseconds(1000);
  settings.watchdog = seconds(5);
  return settings;
}

EmulatedArm::EmulatedArm(const std::string& near, const std::string& far, int bitrate)
    : emulator(arm5e(), emulator_of(bitrate), clock) {
  Arm5eSettings settings = guest_arm_settings();
  CanSettings arms;
  arms.interface = far;
  arms.bitrate = bitrate;
  arms.filters = settings.can_ids.host_filters();
  emulator.serve(open_can(arms, clock));
  settings.can.interface = near;
  settings.can.bitrate = bitrate;
  settings.can.filters = settings.can_ids.arm_filters();
  driver = open_arm5e(settings, arm5e(), clock);
}

EmulatedArm::EmulatedArm(const std::filesystem::path& line, const std::string& near)
    : emulator(arm5e(), emulator_of(500'000), clock) {
  emulator.serve(line);
  Arm5eSettings settings = guest_arm_settings();
  settings.carrier = ArmCarrier::kSerial;
  settings.serial.device = near.empty() ? line.string() : near;
  driver = open_arm5e(settings, arm5e(), clock);
}

void EmulatedArm::home() { driver->set_zero({emulator.true_zero(), {}}); }

bool EmulatedArm::moves_elbow(double by, Duration limit) {
  std::optional<double> begin;
  return becomes_true(
      [&] {
        const auto read = driver->try_read();
        (void)drive(*driver, elbow_at(std::copysign(kElbowSpeed, by)));
        if (!read.ok() || !read.value() || std::isnan(read.value()->q[kElbow])) return false;
        const double elbow = read.value()->q[kElbow];
        if (!begin) begin = elbow;
        return std::abs(elbow - *begin) >= std::abs(by) && (elbow - *begin) * by > 0;
      },
      limit);
}

double EmulatedArm::error_at_rest() {
  double error = 1e9;
  int still = 0;
  std::optional<std::array<std::int32_t, kJoints>> before;
  becomes_true([&] {
    const auto read = driver->try_read();
    (void)drive(*driver, JointVector::Zero());
    if (!read.ok() || !read.value()) return false;
    still = before == read.value()->ticks ? still + 1 : 0;
    before = read.value()->ticks;
    error = (read.value()->q - emulator.truth_at(clock.now())).cwiseAbs().maxCoeff();
    return still >= 5;
  });
  return still >= 5 ? error : 1e9;
}

std::optional<Error> EmulatedArm::next_error(Duration limit) {
  std::optional<Error> error;
  becomes_true(
      [&] {
        const auto read = driver->try_read();
        if (!read.ok()) error = read.error();
        (void)drive(*driver, elbow_at(kElbowSpeed));
        return error.has_value();
      },
      limit);
  return error;
}

double statistic(const Arm& arm, const std::string& name) {
  for (const Statistic& s : arm.statistics())
    if (s.name == name) return s.value;
  throw std::runtime_error("no statistic " + name);
}

}  // namespace tankrig::test
