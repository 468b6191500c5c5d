#include "apps/tankrig/bench/calibration_error.hpp"

namespace tankrig::app {
namespace {

constexpr const char* kLaser = "laser";

Transform moved(const PoseError& pose, double value) {
  const Vector3d axis = Vector3d::Unit(pose.axis);
  Transform out = Transform::Identity();
  if (pose.turns)
    out.linear() = Eigen::AngleAxisd(value, axis).toRotationMatrix();
  else
    out.translation() = value * axis;
  return out;
}

}  // namespace

bool has_target(const SessionInfo& info, const std::string& target) {
  return target == kLaser ? info.calibration.ePl.has_value() : info.has_camera(target);
}

void put_error(const CalibrationError& error, SessionInfo& info) {
  const Transform wrong = moved(error.pose, error.value);
  if (error.target == kLaser) {
    const Eigen::Translation3d exit(info.calibration.laser_origin_e);
    info.calibration.ePl = Transform(exit * wrong * exit.inverse()) * info.calibration.ePl.value();
    return;
  }
  for (CalibratedCamera& camera : info.cameras)
    if (camera.name == error.target) camera.bMc = camera.bMc * wrong;
}

}  // namespace tankrig::app
