// The relay box of the laser on an emulated line, and what the tests of its driver ask.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "core/clock.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/serial/count.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing_support {

using namespace std::chrono_literals;

/// A box on a line in a folder of its own. Time-outs are long: what a test does not provoke must not happen on a loaded
/// machine.
struct Box {
  TemporaryFolder folder;
  MonotonicClock clock;
  sim::RelayEmulatorSettings emulation{.name = folder.path() / "laser", .watchdog = 10s};
  RelayLaserSettings settings{.serial = {.device = (folder.path() / "laser").string(), .baud = 9600},
                              .warm_up = 20ms,
                              .answer_timeout = 500ms,
                              .caller_timeout = 60s,
                              .opening_timeout = 10s};
  sim::MockLaser lamp{20ms, clock};
  std::unique_ptr<sim::RelayEmulator> emulator;

  sim::RelayEmulator& start() {
    emulator = std::make_unique<sim::RelayEmulator>(emulation, lamp);
    return *emulator;
  }
  void with_status() { settings.protocol.status_query = emulation.protocol.status_query = '?'; }
  bool lamp_powered() { return lamp.state().value().powered; }
};

inline bool reaches(RelayLaser& laser, bool powered) {
  return wait_until([&] {
    const auto s = laser.state();
    return s.ok() && s.value().powered == powered;
  });
}

inline bool fails_with(RelayLaser& laser, ErrorCode code) {
  return wait_until([&] {
    const auto s = laser.state();
    return !s.ok() && s.error().code == code;
  });
}

inline bool recovers(RelayLaser& laser) {
  return wait_until([&] { return laser.state().ok(); });
}

}  // namespace tankrig::testing_support
