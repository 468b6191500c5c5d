// Where a camera should see the laser's stripe.
#pragma once

#include "rig/capture/beam_watch.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig {

/// The stripe on an empty tank's floor and walls, from the rig file's camera, arm and laser. It need not be exact: it
/// only tells a stripe out of view from a missing one.
/// Threads: const and safe.
/// RT: never.
class BeamView {
 public:
  BeamView(const RigConfig& rig, const RigCamera& camera);

  /// Whether a good part of the stripe crosses the picture.
  bool expects_stripe(const JointVector& q) const;

 private:
  ArmModel arm_;
  RigLaser laser_;
  CameraModel model_;
  Transform wMb_, cMw_;
  Vector3d half_tank_;  // walls at plus and minus x and y, the floor at z = 0 [w]
};

/// BeamView::expects_stripe of that camera.
StripeInView stripe_in_view(const RigConfig& rig, const RigCamera& camera);

}  // namespace tankrig
