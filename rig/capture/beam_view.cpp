#include "rig/capture/beam_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tankrig {
namespace {

constexpr int kRays = 65;
constexpr double kLeastShare = 0.4;  // of the picture's shorter side that the stripe must cross

}  // namespace

BeamView::BeamView(const RigConfig& rig, const RigCamera& camera)
    : arm_(rig.arm),
      laser_(rig.laser),
      model_(camera.model),
      wMb_(rig.obstacles.wMb),
      cMw_((rig.obstacles.wMb * camera.bMc).inverse()),
      half_tank_(0.5 * rig.obstacles.tank_size.x(), 0.5 * rig.obstacles.tank_size.y(), 0) {}

bool BeamView::expects_stripe(const JointVector& q) const {
  const Transform wMe = wMb_ * arm_.bMe(q);
  const Vector3d origin = wMe * laser_.origin_e;
  const Vector3d middle = wMe.linear() * laser_.direction_e;
  const Vector3d side = wMe.linear() * laser_.ePl.normal.cross(laser_.direction_e).normalized();
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (int i = 0; i < kRays; ++i) {
    const double angle = laser_.fan * (static_cast<double>(i) / (kRays - 1) - 0.5);
    const Vector3d ray = std::cos(angle) * middle + std::sin(angle) * side;
    double length = ray.z() < 0 ? -origin.z() / ray.z() : std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 2; ++axis)
      if (ray[axis] != 0)
        length = std::min(length, (std::copysign(half_tank_[axis], ray[axis]) - origin[axis]) / ray[axis]);
    if (!std::isfinite(length) || length < 0) continue;
    const auto pixel = model_.project(cMw_ * (origin + length * ray));
    if (!pixel || !model_.contains(*pixel)) continue;
    low = low.cwiseMin(*pixel);
    high = high.cwiseMax(*pixel);
  }
  return (high - low).maxCoeff() >= kLeastShare * std::min(model_.width, model_.height);
}

StripeInView stripe_in_view(const RigConfig& rig, const RigCamera& camera) {
  return [view = BeamView(rig, camera)](const JointVector& q) { return view.expects_stripe(q); };
}

}  // namespace tankrig
