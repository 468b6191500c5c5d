#include "core/arm_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tankrig {

double Actuator::angle(double ticks) const {
  if (d == 0) return ticks * rad_per_tick;
  const double l = l_min + ticks * m_per_tick;
  const double c = std::clamp((d * d + r * r - l * l) / (2 * d * r), -1.0, 1.0);
  return sign * (std::acos(c) - alpha0) + q0;
}

double Actuator::ticks(double angle) const {
  if (d == 0) return angle / rad_per_tick;
  const double alpha = sign * (angle - q0) + alpha0;
  const double l = std::sqrt(d * d + r * r - 2 * d * r * std::cos(alpha));
  return (l - l_min) / m_per_tick;
}

double Actuator::resolution(double angle) const {
  if (d == 0) return std::abs(rad_per_tick);
  const double alpha = sign * (angle - q0) + alpha0;
  const double l = std::sqrt(d * d + r * r - 2 * d * r * std::cos(alpha));
  return std::abs(m_per_tick * l / (d * r * std::sin(alpha)));
}

std::array<Transform, 4> ArmModel::link_frames(const JointVector& q) const {
  std::array<Transform, 4> frames;
  Transform m = Transform::Identity();
  for (int i = 0; i < 4; ++i) {
    const DhLink& link = dh[i];
    m = m * Eigen::AngleAxisd(q[i] + link.theta0, Vector3d::UnitZ()) * Eigen::Translation3d(link.a, 0, link.d) *
        Eigen::AngleAxisd(link.alpha, Vector3d::UnitX());
    frames[i] = m;
  }
  return frames;
}

Transform ArmModel::bMe(const JointVector& q) const { return link_frames(q)[3]; }

ArmModel arm5e() {
  constexpr double half_pi = std::numbers::pi / 2;
  ArmModel m;
  m.dh = {
      {{0.08052, half_pi, 0, 0}, {0.44278, 0, 0, 0.139277274}, {-0.083, half_pi, 0, 1.972222055}, {0, 0, 0.54938, 0}}};
  m.limits = {
      {{-1.5708, 0.5488}, {0, 1.58665}, {0, 2.15294}, {-std::numbers::pi, std::numbers::pi}, {-0.05816, 1.337696}}};
  m.actuators[kSlew] = {0.32285, 0.05816, 0.26813, 0.216 / 29568, 0.292535, -half_pi, 1, 0};
  m.actuators[kShoulder] = {0.07308, 0.5370, 0.4675, 0.008 / 1856, 0.292535, 0, 1, 0};
  m.actuators[kElbow] = {0.48902, 0.05386, 0.4370, 0.008 / 1456, 0.2475, 2.15294, -1, 0};
  m.actuators[kJawRotate].rad_per_tick = 0.0031415927;
  m.actuators[kJawOpening].rad_per_tick = 0.000537024;
  return m;
}

}  // namespace tankrig
