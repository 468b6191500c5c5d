// What a trial came to, and whether it is what must come of it.
#pragma once

#include "tests/scenarios/small_rig.hpp"
#include "tests/scenarios/trials.hpp"

namespace tankrig::scenarios {

/// What the emulated devices saw. Stamps are of CLOCK_MONOTONIC.
struct WireMarks {
  std::optional<Stamp> off_byte;  ///< since when the newest command on the relay's line says off
  std::optional<Stamp> opened;    ///< the relay's contact
  std::optional<Stamp> rest;      ///< since when the newest demand on the arm's wire says rest
  bool contact_closed = false;    ///< after the scan
  bool arm_moves = false;         ///< after the scan, and after the time of its own watchdog
  Duration machine_late{};        ///< MachineWitness, in this scan
};

struct Row {
  Trial trial;
  Outcome outcome;
  std::optional<WireMarks> wire;  ///< nothing: the mock rig
};

/// From detection to the byte that says off, the contact that opens and the demand for rest on the wire, at most, on a
/// machine that is never late: two cycles and the line take a tenth of it, the box's own watchdog five times as long.
inline constexpr Duration kOnTheWire = std::chrono::milliseconds{200};
/// Likewise for devices that nobody commands any more: the box's watchdog is 1 s after the last refresh, the arm's 500
/// ms after the last demand and the time it takes to come to rest.
inline constexpr Duration kRelayAlone = std::chrono::milliseconds{1300};
inline constexpr Duration kArmAlone = std::chrono::milliseconds{800};

/// A bound where driver and emulator may each have been given no time for as long as the machine was late.
inline Duration allowed(Duration bound, Duration machine_late) { return bound + 2 * machine_late; }

/// What is not as it must be; empty: nothing.
std::string broken(const Row& row);

/// Nothing was learnt of the fault: the scan ended before it, or another emulated device, which the machine gave no
/// time to answer, stopped it first - and that stop was as it must be.
bool inconclusive(const Row& row);

}  // namespace tankrig::scenarios
