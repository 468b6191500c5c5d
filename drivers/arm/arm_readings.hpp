// What the arm reports about itself: raw encoders, water, temperatures, currents.
#pragma once

#include <algorithm>
#include <array>

#include "drivers/arm/arm_link.hpp"

namespace tankrig {

/// The newest values of each joint and of the master.
struct ArmReadings {
  Stamp stamp{};                              ///< of the newest answer
  std::array<Stamp, kJoints> read{};          ///< of each joint's own
  std::array<std::uint16_t, kJoints> raw{};   ///< encoders as they come
  std::array<std::uint8_t, kJoints> water{};  ///< raw
  std::array<double, kJoints> temperature_c{};
  std::array<double, kJoints> joint_current_a{};  ///< zeros unless the tail of the slots is known
  double current_a = 0, voltage_v = 0, master_temperature_c = 0;

  /// RT: safe.
  void take(const ArmAnswer& answer, const ArmScaling& scaling, TailMeaning tail) noexcept {
    stamp = std::max(answer.read, stamp + Duration{1});
    if (answer.has.master) {
      current_a = scaling.amperes(answer.master.current);
      voltage_v = scaling.volts(answer.master.voltage);
      master_temperature_c = scaling.celsius(answer.master.temperature);
    }
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (!holds(answer.has.sensors, j)) continue;
      const SensorSlot& slot = answer.joints[j];
      read[j] = stamp;
      raw[j] = slot.position;
      water[j] = slot.water_ingress;
      temperature_c[j] = scaling.celsius(slot.temperature);
      joint_current_a[j] = tail == TailMeaning::kLe16 ? scaling.amperes(slot.tail) : 0;
    }
  }
};

}  // namespace tankrig
