// How a simulated rig differs from its drawings: where everything truly is, drawn from a seed.
//
// Only the simulator reads this. Nothing that calibrates, plans or reconstructs may include it.
#pragma once

#include <cstdint>

#include "core/settings_table.hpp"
#include "core/time.hpp"

namespace tankrig::sim {

struct Scene;

/// Moves and turns go in random directions, by this much within a quarter; the rest is uniform between minus and plus.
/// Frames: b does not move, nor do lamps and lux meter.
/// Units: metres, radians, pixels, seconds.
struct TrueRig {
  std::uint64_t seed = 1;
  double camera_moved = 0, camera_turned = 0;  ///< every camera; cameras relative to another one with that one
  double eye_moved = 0, eye_turned = 0;        ///< the right camera besides, against the left
  double focal = 0;                            ///< share of the focal lengths, both alike
  double centre = 0;                           ///< of the principal point [px]
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;       ///< added to the distortion
  double port_distance = 0, port_turned = 0;   ///< every camera's port, where it has one
  double joint_zero = 0;                     ///< of slew, shoulder, elbow and jaw rotation: encoder reads more by this
  double laser_moved = 0, laser_turned = 0;  ///< the projector on the end effector
  double object_moved = 0, object_turned = 0;  ///< the target, on the floor
  Duration latency{};                          ///< added to every frame's stamp, exactly
};

/// The rig file's `truth`.
extern const SettingsTable<TrueRig> kTrueRigKeys;

/// The scene with everything where it truly is.
Scene as_built(Scene scene, const TrueRig& truth);

}  // namespace tankrig::sim
