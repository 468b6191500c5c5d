// The arm's driver under a clock that stands still, on a bus where only the test answers.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "drivers/arm/arm5e.hpp"
#include "tests/arm/list_bus.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig::testing_support {

using namespace std::chrono_literals;

struct StillArm {
  VirtualClock clock{Stamp{1'000'000'000}};
  Arm5eSettings settings;
  ListBus* bus = nullptr;
  std::unique_ptr<Arm5e> arm;

  StillArm() {
    auto list = std::make_unique<ListBus>();
    bus = list.get();
    arm = std::make_unique<Arm5e>(settings, arm5e(),
                                  std::make_unique<CanArmLink>(std::move(list), settings.can_ids, settings.can.bitrate),
                                  clock);
    EXPECT_TRUE(drive_ticks(*arm, {}).ok());  // the gains
    pass();
  }
  /// At first: until what was asked is given up, and the next request is due.
  void pass(Duration time = 100ms) { clock.sleep_until(clock.now() + time); }

  /// The gains' acknowledgement is on the bus.
  void acknowledge() {
    for (const std::uint16_t id : settings.can_ids.pid_answer) bus->waiting.push_back({id, 8, {}, clock.now()});
  }
  /// A whole answer is on the bus, every encoder at `raw`.
  void answer(std::uint16_t raw) {
    std::array<std::uint16_t, kJoints> all;
    all.fill(raw);
    answer(all);
  }
  void answer(const std::array<std::uint16_t, kJoints>& raw, std::uint8_t temperature = 0) {
    bus->waiting.push_back({settings.can_ids.master, 3, {}, clock.now()});
    for (std::size_t j = 0; j < kJoints; ++j)
      bus->waiting.push_back({settings.can_ids.sensors[j], 8,
                              encode(SensorSlot{.position = raw[j], .temperature = temperature}), clock.now()});
  }

  /// The newest demand of each joint on the bus.
  bool rests() const {
    std::array<std::uint8_t, kJoints> types{};
    for (const CanFrame& frame : bus->sent)
      for (std::size_t j = 0; j < kJoints; ++j)
        if (frame.id == settings.can_ids.demand[j]) types[j] = frame.data[0];
    return types == std::array<std::uint8_t, kJoints>{};
  }
};

}  // namespace tankrig::testing_support
