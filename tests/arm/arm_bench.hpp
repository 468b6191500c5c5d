// A driver and an emulated arm on one of their wires, in real time.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <ostream>
#include <string>

#include "drivers/arm/arm5e.hpp"
#include "sim_backends/wire/arm_emulator.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim::testing_support {

using namespace std::chrono_literals;

enum class Wire { kPair, kFastPair, kPty };
inline constexpr std::array kWires{Wire::kPair, Wire::kFastPair, Wire::kPty};

inline std::string wire_name(const ::testing::TestParamInfo<Wire>& wire) {
  return std::array{"CanPair", "FastCanPair", "Serial"}.at(static_cast<std::size_t>(wire.param));
}
inline void PrintTo(Wire wire, std::ostream* out) { *out << wire_name({wire, 0}); }

inline JointVector elbow(double velocity) {
  JointVector v = JointVector::Zero();
  v[kElbow] = velocity;
  return v;
}

/// What is to be set is set before make().
struct ArmBench {
  MonotonicClock clock;
  ArmModel model = arm5e();
  ArmEmulatorParameters parameters;
  Arm5eSettings settings;
  TemporaryFolder folder;
  std::unique_ptr<ArmEmulator> emulator;
  std::unique_ptr<Arm5e> arm;

  explicit ArmBench(Wire wire = Wire::kPair) : wire_(wire) {
    parameters.plant.stall_rise = 0.02;
    parameters.can_paced = true;
    settings.homing.pause = 100ms;
    settings.homing.back_off_ticks = 100;
    settings.silence_timeout = 1s;  // the machine may be busy
    settings.reply_timeout = 60ms;
    if (wire == Wire::kFastPair) {
      settings.fast_joint = kElbow;
      settings.exchange_rate_hz = 200;
    }
    if (wire == Wire::kPty) {
      settings.carrier = ArmCarrier::kSerial;
      settings.exchange_rate_hz = 50;
      settings.serial.device = folder.path() / "arm";
    }
  }

  void make(bool homed = true) {
    emulator = std::make_unique<ArmEmulator>(model, parameters, clock);
    connect();
    if (homed) arm->set_zero({emulator->true_zero(), "by truth"});
  }
  /// A driver for the emulator that is there.
  void connect() {
    if (wire_ != Wire::kPty) {
      auto [driver, device] = make_can_pair(clock);
      emulator->serve(std::move(device));
      arm = std::make_unique<Arm5e>(settings, model,
                                    std::make_unique<CanArmLink>(std::move(driver), settings.can_ids,
                                                                 settings.can.bitrate, settings.encoder_latency),
                                    clock);
    } else {
      emulator->serve(folder.path() / "arm");
      arm = open_arm5e(settings, model, clock);
    }
  }

  /// Calls `each` every 5 ms until it is true; false at the deadline.
  template <class Each>
  bool until(Each each, Duration deadline = 10s) {
    for (const Stamp end = clock.now() + deadline; clock.now() < end; clock.sleep_until(clock.now() + 5ms))
      if (each()) return true;
    return false;
  }

  /// Driven at 0.1 rad/s until it moves so.
  bool elbow_swings() {
    return until([&] {
      (void)arm->try_read();
      EXPECT_TRUE(drive(*arm, elbow(0.1)).ok());
      return emulator->true_velocity_at(clock.now())[kElbow] > 0.09;
    });
  }

  /// Reads until a state comes.
  JointState state() {
    std::optional<JointState> found;
    EXPECT_TRUE(until([&] {
      const auto news = arm->try_read();
      if (news.ok() && news.value()) found = news.value();
      return found.has_value();
    }));
    return found.value_or(JointState{});
  }

  /// Reads, and commands `velocity` if there is one, until try_read fails.
  Error error(const std::optional<JointVector>& velocity = {}, Duration deadline = 10s) {
    Error found;
    found.where = "no error";
    until(
        [&] {
          const auto news = arm->try_read();
          if (!news.ok()) found = news.error();
          if (velocity) (void)drive(*arm, *velocity);
          return !news.ok();
        },
        deadline);
    return found;
  }

  double statistic(const std::string& name) const {
    for (const Statistic& s : arm->statistics())
      if (s.name == name) return s.value;
    ADD_FAILURE() << "no statistic " << name;
    return -1;
  }

 private:
  Wire wire_;
};

}  // namespace tankrig::sim::testing_support
