// Checks the whole plan before anything moves: joint limits, actuator speed, and clearance.
#pragma once

#include <array>
#include <limits>
#include <string>

#include "rig/plan/clearance.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// What a joint may do, beside its limits in the arm model.
struct MotionLimits {
  double angle_margin = 0.05;     ///< kept from every joint limit: the laboratory's [rad]
  double stop_margin = 0.02;      ///< how far beyond a limit a joint may stand at its stop when the plan begins [rad]
  double max_velocity = 1.0;      ///< any joint [rad/s]
  double max_ticks_per_s = 2000;  ///< any actuator; the laboratory's RPM_LIMIT
};

/// The nearest approach of two bodies.
struct Approach {
  double clearance = std::numeric_limits<double>::infinity();  ///< [m]
  std::string pair;                                            ///< obstacle and body: "object: forearm"
  std::string segment;                                         ///< its name
  double when = 0;                                             ///< plan time [s]
  JointVector q = JointVector::Zero();                         ///< [rad]
};

struct MotionCheck {
  std::array<Approach, kPairKindNames.size()> nearest_of{};  ///< by PairKind; no pair where there is no such obstacle

  const Approach& nearest() const;
};

/// No pair comes nearer, at any time in the plan, than its kind's nearest approach minus this [m].
inline constexpr double kClearanceAccuracy = 0.5e-3;

/// Refuses a plan whose joints leave their limits or whose bodies come nearer than the margin.
/// Clearance is not sampled at fixed times: a pair is checked again before it could have come nearer than the nearest
/// of its kind by more than kClearanceAccuracy, given how fast its bodies can approach. Joints are checked whenever one
/// has moved by 5 mrad.
/// Errors: InputError naming the joint, its value and its limit, or the pair, its clearance and the posture; then the
/// segment and its time.
MotionCheck check_motion(const ScanPlan& plan, const ArmModel& arm, const Obstacles& obstacles,
                         const MotionLimits& limits = {});

/// "slew 0.0, shoulder 7.4, elbow 98.0, jaw_rotate 0.0 deg": the joints that clearance depends on.
std::string posture_text(const JointVector& q);

}  // namespace tankrig
