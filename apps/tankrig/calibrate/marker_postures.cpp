#include "apps/tankrig/calibrate/marker_postures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/tankrig/scan/plan_check.hpp"
#include "core/input_error.hpp"
#include "rig/plan/clearance.hpp"
#include "rig/plan/operator_plan.hpp"

namespace tankrig::app {
namespace {

constexpr double kEdge = 0.06;       // share of the image that the marker stays away from its border
constexpr double kMostTilt = 1.0;    // between the marker's normal and the view [rad]
constexpr double kFromLimit = 0.06;  // [rad]
// Assumptions about the plate that the marker is on.
constexpr double kPlateEdge = 0.015, kPlateThickness = 0.01;  // beyond the marker's points; behind them [m]
constexpr int kSteps[] = {7, 5, 9, 9};                        // slew, shoulder, elbow, jaw rotation

bool seen(const RigCamera& camera, const RigConfig& rig, const GripperTarget& target, const JointVector& q) {
  const Transform cMg = camera.bMc.inverse() * rig.arm.bMe(q) * target.eMg;
  const double width = camera.model.width, height = camera.model.height;
  const std::vector<Vector3d> points = points_of(target.marker);
  for (const Vector3d& g : points) {
    const Vector3d c = cMg * g;
    if (c.z() < 0.15) return false;
    const auto pixel = camera.model.project(c);
    if (!pixel || pixel->x() < kEdge * width || pixel->x() > (1 - kEdge) * width || pixel->y() < kEdge * height ||
        pixel->y() > (1 - kEdge) * height)
      return false;
    if ((cMg.linear().col(2)).dot(c.normalized()) < std::cos(kMostTilt)) return false;
  }
  return true;
}

/// The rig with the marker's plate in its gripper.
RigConfig with_plate(RigConfig rig, const GripperTarget& target) {
  Eigen::AlignedBox3d points;
  for (const Vector3d& g : points_of(target.marker)) points.extend(g);
  const Vector3d middle = points.center() + 0.5 * kPlateThickness * Vector3d::UnitZ();
  const Vector3d size = points.sizes() + Vector3d(2 * kPlateEdge, 2 * kPlateEdge, kPlateThickness);
  rig.obstacles.carried.push_back({"marker's plate", Box{target.eMg * Eigen::Translation3d(middle), size}});
  return rig;
}

/// Where the marker is seen and the arm keeps clear, on a grid over the joints.
std::vector<JointVector> candidates(const RigConfig& rig, const GripperTarget& target, const JointVector& from,
                                    Progress& progress) {
  const RigCamera& camera = *rig.find_camera(CameraRole::kMono);
  const Clearance clearance(rig.arm, obstacles_of(rig));
  const double margin = rig.obstacles.margin + 0.03;
  const auto value = [&](int joint, int step) {
    const JointLimit& limit = rig.arm.limits[static_cast<std::size_t>(joint)];
    const double least = std::max(limit.lower, -1.6) + kFromLimit, most = std::min(limit.upper, 1.6) - kFromLimit;
    return least + (most - least) * step / (kSteps[joint] - 1);
  };
  std::vector<JointVector> found;
  JointVector q = from;
  for (int slew = 0; slew < kSteps[0]; ++slew) {
    progress.update("looking for postures that show the marker", double(slew) / kSteps[0]);
    for (int shoulder = 0; shoulder < kSteps[1]; ++shoulder)
      for (int elbow = 0; elbow < kSteps[2]; ++elbow)
        for (int jaw = 0; jaw < kSteps[3]; ++jaw) {
          q[kSlew] = value(kSlew, slew);
          q[kShoulder] = value(kShoulder, shoulder);
          q[kElbow] = value(kElbow, elbow);
          q[kJawRotate] = value(kJawRotate, jaw);
          if (!seen(camera, rig, target, q)) continue;
          bool clear = true;
          for (std::size_t pair = 0; clear && pair < clearance.pairs(); ++pair) clear = clearance.at(pair, q) > margin;
          if (clear) found.push_back(q);
        }
  }
  return found;
}

double apart(const JointVector& a, const JointVector& b) { return (a - b).head<4>().norm(); }

bool may_move(const RigConfig& rig, const JointVector& from, const JointVector& to) {
  try {
    check_plan(rig, make_move_plan(rig.scan, from, to, "move"));
    return true;
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

std::vector<JointVector> marker_postures(const RigConfig& bare, const GripperTarget& target, const JointVector& from,
                                         Progress& progress) {
  const RigConfig rig = with_plate(bare, target);
  std::vector<JointVector> left = candidates(rig, target, from, progress);
  const std::size_t seen_in = left.size();
  const auto wanted = static_cast<std::size_t>(target.postures);
  // The farthest from all that are chosen, again and again: they span what can be reached.
  std::vector<JointVector> chosen;
  while (chosen.size() < 2 * wanted && !left.empty()) {
    const auto nearest = [&](const JointVector& q) {
      double least = chosen.empty() ? -apart(q, from) : HUGE_VAL;
      for (const JointVector& c : chosen) least = std::min(least, apart(q, c));
      return least;
    };
    const auto next = std::max_element(left.begin(), left.end(),
                                       [&](const auto& a, const auto& b) { return nearest(a) < nearest(b); });
    chosen.push_back(*next);
    left.erase(next);
  }
  // By the shortest next move that is allowed; the half that was chosen last stands in for what cannot be reached.
  std::vector<JointVector> first(chosen.begin(),
                                 chosen.begin() + static_cast<std::ptrdiff_t>(std::min(wanted, chosen.size()))),
      spare(chosen.begin() + static_cast<std::ptrdiff_t>(first.size()), chosen.end());
  std::vector<JointVector> order;
  JointVector at = from;
  for (std::vector<JointVector>* part : {&first, &spare}) {
    while (!part->empty() && order.size() < wanted) {
      const auto next = std::min_element(part->begin(), part->end(),
                                         [&](const auto& a, const auto& b) { return apart(a, at) < apart(b, at); });
      const JointVector to = *next;
      part->erase(next);
      progress.update("checking the moves between postures", double(order.size()) / double(wanted));
      if (!may_move(rig, at, to) || !may_move(rig, to, from)) continue;
      order.push_back(to);
      at = to;
    }
  }
  progress.finish_line();
  if (order.size() < kLeastPostures)
    throw InputError(rig.file,
                     fmt::format("targets: gripper: found {} postures that show the marker and can be driven to, of {} "
                                 "that show it, expected at least {}: see its eMg, and what the arm must keep clear of",
                                 order.size(), seen_in, kLeastPostures));
  return order;
}

}  // namespace tankrig::app
