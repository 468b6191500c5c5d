// The arm driver and the arm's emulator, each at one end of a wire of the guest's.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/clock.hpp"
#include "drivers/arm/arm5e.hpp"
#include "sim_backends/wire/arm_emulator.hpp"

namespace tankrig::test {

/// Time-outs for an emulated processor on a busy host; the driver's own are for a real arm.
Arm5eSettings guest_arm_settings();

/// Driver on `near`, emulator on `far`: interfaces of one bus, or one and the same.
class EmulatedArm {
 public:
  EmulatedArm(const std::string& near, const std::string& far, int bitrate);
  /// Driver on a serial line whose other end is `line`, a pty made by the emulator.
  explicit EmulatedArm(const std::filesystem::path& line, const std::string& near = {});

  /// Tells the driver where its zeros are.
  void home();
  /// Drives the elbow until it is `by` further; false if it is not there in time. Errors on the way are passed over.
  bool moves_elbow(double by, Duration limit = std::chrono::seconds(30));
  /// Stops, waits for rest, and returns how far the last reading is from the truth [rad].
  double error_at_rest();
  /// Reads and writes until try_read fails, and returns that error.
  std::optional<Error> next_error(Duration limit = std::chrono::seconds(30));

  MonotonicClock clock;
  sim::ArmEmulator emulator;
  std::unique_ptr<Arm5e> driver;
};

double statistic(const Arm& arm, const std::string& name);

}  // namespace tankrig::test
