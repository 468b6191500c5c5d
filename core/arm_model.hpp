// ARM5E: kinematics (Denavit-Hartenberg) and the geometry of its linear actuators.
#pragma once

#include <array>
#include <string>

#include "core/enum_names.hpp"
#include "core/frames.hpp"

namespace tankrig {

inline constexpr int kJoints = 5;
enum Joint : int { kSlew, kShoulder, kElbow, kJawRotate, kJawOpening };
inline constexpr std::array<const char*, kJoints> kJointNames{"slew", "shoulder", "elbow", "jaw_rotate", "jaw_opening"};
template <>
inline constexpr auto kNames<Joint> = kJointNames;

/// One value per joint, in the order of `Joint`: rad, rad/s, or what the name says.
using JointVector = Eigen::Matrix<double, kJoints, 1>;

/// One link of the standard DH chain: Rz(q + theta0) Tz(d) Tx(a) Rx(alpha); m and rad.
struct DhLink {
  double a = 0, alpha = 0, d = 0, theta0 = 0;
};

struct JointLimit {
  double lower = 0, upper = 0;  ///< rad
};

/// Ticks <-> joint angle of one axis.
/// A linear axis is a triangle with sides d, r [m]. The actuator's length l = l_min + ticks * m_per_tick is opposite
/// the angle alpha: cos alpha = (d^2 + r^2 - l^2) / (2 d r);  q = sign * (alpha - alpha0) + q0.
/// A rotary axis (d == 0) is q = ticks * rad_per_tick.
struct Actuator {
  double d = 0, r = 0, l_min = 0, m_per_tick = 0, alpha0 = 0, q0 = 0;
  int sign = 1;
  double rad_per_tick = 0;

  double angle(double ticks) const;
  /// Exact inverse of angle(); not rounded.
  double ticks(double angle) const;
  /// |dq/dticks| at `angle` [rad/tick].
  double resolution(double angle) const;
};

/// Source: the laboratory's public kinematics and controller (docs/reference/arm5e.md); everything here comes from the rig file.
struct ArmModel {
  std::array<DhLink, 4> dh{};
  std::array<JointLimit, kJoints> limits{};
  std::array<Actuator, kJoints> actuators{};

  /// End effector in the arm base. Uses slew, shoulder, elbow and jaw rotation; the jaw's opening moves nothing.
  Transform bMe(const JointVector& q) const;

  /// Frames after each DH link (index 3 is bMe), in b: for drawing and clearance.
  std::array<Transform, 4> link_frames(const JointVector& q) const;
};

/// The public ARM5E: DH of the UWSim/merbots model with d4 = 0.54938 m, controller geometry of ARM5Control.
ArmModel arm5e();

}  // namespace tankrig
