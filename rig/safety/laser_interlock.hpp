// The safety step: whether the laser may shine and the arm may move, decided once per cycle.
#pragma once

#include <cstdint>
#include <type_traits>

#include "core/time.hpp"

namespace tankrig {

/// What the cameras say of the beam, compared with what the laser's device says.
enum class BeamVerdict : std::uint8_t {
  kNone,     ///< no contradiction, or nobody looks
  kMissing,  ///< not seen though it is on
  kStray,    ///< seen though it is off
};

struct InterlockLimits {
  Duration indicator_delay{};  ///< from arming to the first light
  Duration maximum_on{};       ///< a stretch of light
  Duration hold{};             ///< light with the arm at rest, for one request
};

/// What the cycle knows when it asks. Levels; edges are found by the step itself.
struct InterlockInputs {
  Stamp now{};
  bool arm = false;               ///< arming switch: a scan's own, once it is begun
  bool hold = false;              ///< operator's request for light with the arm at rest
  bool interlock_closed = false;  ///< lid, key, door: open means no emission
  bool heartbeat_fresh = false;   ///< the supervising loop was heard of lately
  bool at_rest = false;           ///< the arm, as measured
  bool sweeping = false;          ///< the plan is between the laser's warm-up and the end of the last pass
  bool device_fault = false;      ///< arm, laser, following error, overrun: anything the cycle calls a fault
  bool slept = false;             ///< the machine was suspended since the step before
  bool laser_request = false;     ///< the laser schedule wants light now
  bool enabled = true;            ///< the watchdog box says that it feeds arm and laser; true where none is read
  bool homing = false;            ///< the operator's request to drive axes whose angles are not known
  BeamVerdict beam = BeamVerdict::kNone;
};

struct InterlockState {
  bool armed = false;
  bool latched = false;
  bool holding = false;
  bool last_arm = true;  ///< a switch found closed at power-up is no edge
  bool last_hold = true;
  bool last_enabled = false;
  bool stretch = false;  ///< light, and the time after it in which new light belongs to the same stretch
  Stamp armed_at{};      ///< while armed
  Stamp held_at{};       ///< while holding: when it began
  Stamp lit_at{};        ///< in a stretch: when it began
  Stamp last_lit{};      ///< in a stretch: the newest step with light
};
static_assert(std::is_trivially_copyable_v<InterlockState>);

/// Why a step latched; the first that applies.
enum class Trip : std::uint8_t {
  kNone,
  kSlept,      ///< the machine was suspended
  kDevice,     ///< device_fault
  kBeam,       ///< the beam's verdict
  kDisabled,   ///< the watchdog box cut arm and laser off, or feeds neither though armed or homing
  kHeartbeat,  ///< late while armed or homing
  kInterlock,  ///< open while armed or homing
  kMaximumOn,  ///< light asked for beyond maximum_on
  kMotion,     ///< the arm moved in a hold
};

struct InterlockOutputs {
  bool laser = false;       ///< beam allowed and wanted
  bool motion = false;      ///< arm may move
  bool homing = false;      ///< axes may be driven though their angles are not known
  Trip trip = Trip::kNone;  ///< a fault was latched by this very step
};

struct InterlockStep {
  InterlockState state;
  InterlockOutputs outputs;
};

// clang-format off
/// Software in series with the laser's own interlock, never instead of it.
///
/// State: the first row that applies. "-": any; "edge": now true, was false in the previous step.
///   fault   device fault, or a beam verdict other than kNone
///   cut     not enabled, though it was in the step before, or armed or homing now
///   lines   interlock closed AND heartbeat fresh AND enabled
///   over    light is asked for, and its stretch is longer than maximum_on
///   time    the hold is younger than its limit
///
///   | latched armed holding | arm  hold homing | slept fault cut  lines over rest sweeping time | -> latched armed holding |
///   | yes     -     -       | -    -    -      | -     -     -    -     -    -    -        -    | -> yes     no    no      |
///   | no      -     -       | -    -    -      | yes   -     -    -     -    -    -        -    | -> yes     no    no      |  the machine slept, armed or not
///   | no      -     -       | -    -    -      | -     yes   -    -     -    -    -        -    | -> yes     no    no      |  trips, armed or not
///   | no      -     -       | -    -    -      | -     -     yes  -     -    -    -        -    | -> yes     no    no      |  the box opened its contactors
///   | no      yes   -       | -    -    -      | -     -     -    no    -    -    -        -    | -> yes     no    no      |  interlock, heartbeat
///   | no      -     -       | -    -    yes    | -     -     -    no    -    -    -        -    | -> yes     no    no      |  the same while homing
///   | no      yes   -       | -    -    -      | -     -     -    -     yes  -    -        -    | -> yes     no    no      |  lit for too long
///   | no      yes   yes     | -    -    -      | -     -     -    -     -    no   -        -    | -> yes     no    no      |  moved in a hold
///   | no      yes   -       | no   -    -      | -     -     -    -     -    -    -        -    | -> no      no    no      |  disarming is no fault
///   | no      yes   yes     | -    yes  -      | -     -     -    -     -    -    no       yes  | -> no      yes   yes     |
///   | no      yes   yes     | -    -    -      | -     -     -    -     -    -    -        -    | -> no      yes   no      |  let go, or its time is up
///   | no      yes   no      | -    edge -      | -     -     -    -     -    yes  no       -    | -> no      yes   yes     |
///   | no      yes   no      | -    -    -      | -     -     -    -     -    -    -        -    | -> no      yes   no      |
///   | no      no    -       | edge -    -      | -     -     -    yes   -    -    -        -    | -> no      yes   no      |
///   | no      no    -       | -    -    -      | -     -     -    -     -    -    -        -    | -> no      no    no      |  an edge while not good is lost
///
/// Outputs, from the new state:
///
///   laser  = armed AND laser_request AND (sweeping OR holding) AND armed for indicator_delay or longer
///            AND NOT in a stretch longer than maximum_on
///   motion = NOT latched AND NOT holding AND enabled
///   homing = motion AND homing asked for AND NOT armed AND interlock closed AND heartbeat fresh
///
/// Latched is for good: a fault ends the scan.
/// So light means: armed by an edge, indicated before, lines closed, no fault, in a sweep or in a hold at rest, and not
/// beyond maximum_on. Whoever acts on it takes the laser off first, then stops the arm.
/// RT: safe.
// clang-format on
InterlockStep step(const InterlockState& state, const InterlockInputs& in, const InterlockLimits& limits) noexcept;

}  // namespace tankrig
