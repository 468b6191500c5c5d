#include "calibration/time_offset/joint_motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace tankrig {

JointMotion motion_at(const std::vector<TimedJoints>& joints, Stamp when) {
  constexpr std::ptrdiff_t kLeastReadings = 6;  // within the reach, for a parabola
  const auto earlier = [](const TimedJoints& j, Stamp t) { return j.stamp < t; };
  const auto first = std::lower_bound(joints.begin(), joints.end(), when - from_seconds(kMotionReach), earlier);
  const auto last = std::lower_bound(first, joints.end(), when + from_seconds(kMotionReach), earlier);
  if (last - first >= kLeastReadings) {
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 3, JointVector::RowsAtCompileTime> g;
    g.setZero();
    for (auto j = first; j != last; ++j) {
      const double t = seconds(j->stamp - when) / kMotionReach;
      const Eigen::Vector3d powers(1, t, t * t);
      h += powers * powers.transpose();
      g += powers * j->q.transpose();
    }
    g = h.ldlt().solve(g).eval();
    return {g.row(0).transpose(), g.row(1).transpose() / kMotionReach};
  }
  const auto after = std::clamp(std::lower_bound(joints.begin(), joints.end(), when, earlier),
                                std::next(joints.begin()), std::prev(joints.end()));
  const TimedJoints &a = *std::prev(after), &b = *after;
  const JointVector velocity = (b.q - a.q) / seconds(b.stamp - a.stamp);
  return {a.q + velocity * seconds(when - a.stamp), velocity};
}

}  // namespace tankrig
