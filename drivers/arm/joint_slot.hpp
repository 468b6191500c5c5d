// One joint's slot: the eight data bytes that arm and host exchange about a joint, on any carrier.
#pragma once

#include <array>
#include <cstdint>

#include "core/enum_names.hpp"

namespace tankrig {

/// Bytes 1..8 of a serial channel slot, or the payload of one CAN frame. The slot's kind (its byte 0) travels beside.
/// Layout: irs-ros-pkg arm5e/arm5_controller ARM5Coms (source A) and gitAnto/eca_arm5emicro_driver (source B);
/// docs/reference/arm5e.md.
/// RT: everything here is safe and allocation-free.
using SlotBytes = std::array<std::uint8_t, 8>;

/// What a host sends in a slot.
enum class HostSlot : std::uint8_t { kDemand = 0, kPid = 1 };
/// What the arm answers, low nibble of the kind byte.
enum class ArmSlot : std::uint8_t { kDemandEcho = 0, kSensors = 1, kCalibration = 2, kPid = 3 };

enum class DemandType : std::uint8_t {
  kStop = 0,
  kVoltageForward = 1,
  kVoltageBackward = 2,
  kSpeedForward = 3,   ///< clockwise, ticks grow
  kSpeedBackward = 4,  ///< counter-clockwise
  kPosition = 5,
  kCurrent = 6,
};

inline constexpr std::uint16_t kLargestSpeed = 0x0FFF;  ///< speeds and limits have 12 bits

struct DemandSlot {
  DemandType type = DemandType::kStop;
  std::uint16_t demand = 0;       ///< with the speed types: ticks/s
  std::uint16_t speed_limit = 0;  ///< raw
  std::uint16_t current_limit = 0;

  bool operator==(const DemandSlot&) const = default;
};

struct PidGains {
  std::uint8_t p = 0, i = 0, d = 0;
  bool operator==(const PidGains&) const = default;
};

struct PidSlot {
  PidGains position, speed;
  bool operator==(const PidSlot&) const = default;
};

struct SensorSlot {
  std::uint16_t position = 0;      ///< relative encoder, zero at power-up, wraps [ticks]
  std::uint16_t speed = 0;         ///< two's complement of the signed speed; its unit is not public, assumed ticks/s
  std::uint8_t water_ingress = 0;  ///< raw
  std::uint8_t temperature = 0;    ///< raw
  std::uint16_t tail = 0;          ///< bytes 7..8, little-endian: the sources disagree on their meaning

  bool operator==(const SensorSlot&) const = default;
};

/// What the disputed bytes 7..8 of a sensor slot are.
enum class TailMeaning : std::uint8_t {
  kMaster,  ///< unused: only the whole arm's current is known
  kLe16,    ///< the joint's motor current, little-endian (source A), scaled as the master's
};
template <>
inline constexpr std::array kNames<TailMeaning>{"master", "le16"};

/// A demand whose low byte is 0x0A is never sent; the next larger one is sent instead (source A).
constexpr std::uint16_t sendable(std::uint16_t demand) noexcept {
  return (demand & 0xFF) == 0x0A ? static_cast<std::uint16_t>(demand + 1) : demand;
}

constexpr SlotBytes encode(const DemandSlot& slot) noexcept {
  const auto high = [](std::uint16_t v) { return static_cast<std::uint8_t>(v >> 8); };
  const auto low = [](std::uint16_t v) { return static_cast<std::uint8_t>(v); };
  const std::uint16_t demand = sendable(slot.demand);
  return {static_cast<std::uint8_t>(slot.type),
          high(demand),
          low(demand),
          high(slot.speed_limit),
          low(slot.speed_limit),
          high(slot.current_limit),
          low(slot.current_limit),
          0};
}

constexpr SlotBytes encode(const PidSlot& slot) noexcept {
  return {slot.position.p, slot.position.i, slot.position.d, slot.speed.p, slot.speed.i, slot.speed.d, 0, 0};
}

constexpr SlotBytes encode(const SensorSlot& slot) noexcept {
  const auto high = [](std::uint16_t v) { return static_cast<std::uint8_t>(v >> 8); };
  const auto low = [](std::uint16_t v) { return static_cast<std::uint8_t>(v); };
  return {low(slot.position), high(slot.position), low(slot.speed), high(slot.speed),
          slot.water_ingress, slot.temperature,    low(slot.tail),  high(slot.tail)};
}

/// Types above 6 pass unchanged: see known().
constexpr DemandSlot decode_demand(const SlotBytes& b) noexcept {
  const auto big = [](std::uint8_t high, std::uint8_t low) { return static_cast<std::uint16_t>(high << 8 | low); };
  return {static_cast<DemandType>(b[0]), big(b[1], b[2]), big(b[3], b[4]), big(b[5], b[6])};
}

constexpr bool known(DemandType type) noexcept { return type <= DemandType::kCurrent; }

constexpr SensorSlot decode_sensors(const SlotBytes& b) noexcept {
  const auto little = [](std::uint8_t low, std::uint8_t high) { return static_cast<std::uint16_t>(high << 8 | low); };
  return {little(b[0], b[1]), little(b[2], b[3]), b[4], b[5], little(b[6], b[7])};
}

/// The arm's master bytes: bytes 1..3 of a serial frame.
struct MasterBytes {
  std::uint8_t temperature = 0, voltage = 0, current = 0;
  bool operator==(const MasterBytes&) const = default;
};

/// Raw counts to units: value = raw * per_count + offset.
struct ArmScaling {
  double volt_per_count, ampere_per_count, ampere_offset, celsius_per_count;

  constexpr double volts(std::uint8_t raw) const noexcept { return raw * volt_per_count; }
  constexpr double amperes(std::uint16_t raw) const noexcept { return raw * ampere_per_count + ampere_offset; }
  constexpr double celsius(std::uint8_t raw) const noexcept { return raw * celsius_per_count; }
};

/// Source A, by its circuit's resistors: V = raw/255 3.3/(6800/111500); I = raw/511 3.3/(39/59)/0.625 6 - 0.2 A;
/// T = raw/255 3.3/0.00661017 degrees Celsius.
constexpr ArmScaling laboratory_scaling() noexcept {
  return {3.3 / 255 / (6800.0 / 111500.0), 3.3 / 511 / (39.0 / 59.0) / 0.625 * 6, -0.2, 3.3 / 255 / 0.00661017};
}

/// Source B, for the ARM 5E Micro: 0.21 V, 0.094 A - 0.2 A, 1.96 degrees Celsius per count. It calls its currents mA;
/// the factor is source A's in A.
constexpr ArmScaling micro_scaling() noexcept { return {0.21, 0.094, -0.2, 1.96}; }

}  // namespace tankrig
