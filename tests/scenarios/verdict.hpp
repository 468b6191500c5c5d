// What a trial came to, and whether it is what must come of it.
#pragma once

#include "tests/scenarios/small_rig.hpp"
#include "tests/scenarios/trials.hpp"
#include "tests/support/machine_witness.hpp"

namespace tankrig::scenarios {

/// What the emulated devices saw. Stamps are of CLOCK_MONOTONIC.
struct WireMarks {
  std::optional<Stamp> off_byte;  ///< since when the newest command on the relay's line says off
  std::optional<Stamp> opened;    ///< the relay's contact
  std::optional<Stamp> rest;      ///< since when the newest demand on the arm's wire says rest
  bool contact_closed = false;    ///< after the scan
  /// The watchdog box, after the scan: its newest edge, its contactors' opening, and whether they are closed.
  std::optional<Stamp> last_edge, cut;
  bool fed = false;
  /// Until the arm rested after the scan, for want of power where nobody could stop it; nothing: never.
  std::optional<Duration> rested_after;
  Duration machine_late{};  ///< MachineWitness, in this scan
};

struct Row {
  Trial trial;
  Outcome outcome;
  std::optional<WireMarks> wire;  ///< nothing: the mock rig
};

/// From detection to the byte that says off, the contact that opens and the demand for rest on the wire, at most: two
/// cycles and the line take a tenth of it.
inline constexpr Duration kOnTheWire = std::chrono::milliseconds{200};
/// From the watchdog box's last edge to both contactors open, at most.
inline constexpr Duration kBoxOpens = std::chrono::milliseconds{200};
/// From the scan's end to an arm at rest that nobody can command: the box, and the time it takes to come to rest.
inline constexpr Duration kArmAlone = std::chrono::milliseconds{500};
/// Of a recorded frame's stamp, against its exposure: half a frame's period.
inline constexpr Duration kStampError = std::chrono::milliseconds{20};
/// They are watched for so long.
inline constexpr Duration kWatched = std::chrono::seconds{10};

/// A machine that is later tells nothing of the time that drivers and devices take.
inline constexpr Duration kBearable = testing_support::kStarved;
inline bool too_late(const Row& row) { return row.wire && row.wire->machine_late > kBearable; }

/// What is not as it must be; empty: nothing. Of a row that is too_late() only what no lateness excuses.
std::string broken(const Row& row);

}  // namespace tankrig::scenarios
