// The safety step: whether the laser may shine and the arm may move, decided once per cycle.
#pragma once

#include <type_traits>

namespace tankrig {

/// What the cycle knows when it asks. Levels; edges are found by the step itself.
struct InterlockInputs {
  bool arm = false;               ///< operator's arming switch
  bool reset = false;             ///< operator's reset button
  bool interlock_closed = false;  ///< lid, key, door: open means no emission
  bool heartbeat_fresh = false;   ///< the supervising loop was heard of lately
  bool sweeping = false;          ///< the plan is between the laser's warm-up and the end of the last pass
  bool device_fault = false;      ///< arm, laser, following error, overrun: anything the cycle calls a fault
  bool laser_request = false;     ///< the laser schedule wants light now
};

struct InterlockState {
  bool armed = false;
  bool latched = false;
  bool last_arm = true;  ///< a switch found closed at power-up is no edge
  bool last_reset = true;
};
static_assert(std::is_trivially_copyable_v<InterlockState>);

struct InterlockOutputs {
  bool laser = false;    ///< beam allowed and wanted
  bool motion = false;   ///< arm may move
  bool tripped = false;  ///< a fault was latched by this very step
};

struct InterlockStep {
  InterlockState state;
  InterlockOutputs outputs;
};

// clang-format off
/// Software in series with the laser's own interlock, never instead of it.
///
/// State: the first row that applies. "-": any; "edge": now true, was false in the previous step; good: interlock closed
/// AND heartbeat fresh AND no device fault.
///
///   latched  armed  arm    reset  good           ->  latched  armed
///   yes      -      -      edge   yes                no       no     reset needs everything good; arm again after it
///   yes      -      -      -      -                  yes      no
///   no       -      -      -      device fault       yes      no     trips, armed or not
///   no       yes    -      -      no                 yes      no     losing interlock or heartbeat while armed trips
///   no       yes    false  -      yes                no       no     disarming is no fault
///   no       yes    true   -      yes                no       yes
///   no       no     edge   -      yes                no       yes
///   no       no     -      -      -                  no       no     an edge while not good is lost: lift it again
///
/// Outputs, from the new state:
///
///   laser  = armed AND sweeping AND laser_request      (armed implies good)
///   motion = NOT latched
///
/// Whoever acts on it takes the laser off first, then stops the arm.  RT: safe.
// clang-format on
InterlockStep step(const InterlockState& state, const InterlockInputs& in) noexcept;

}  // namespace tankrig
