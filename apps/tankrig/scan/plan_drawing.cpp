#include "apps/tankrig/scan/plan_drawing.hpp"

#include <algorithm>
#include <cmath>

#include "apps/tankrig/scan/plan_check.hpp"
#include "apps/tankrig/scan/shown_scan.hpp"
#include "rig/plan/nearest_points.hpp"

namespace tankrig::app {
namespace {

using nlohmann::ordered_json;

constexpr int kPoses = 241;
constexpr double kFarthest = 3;  // that the sheet is drawn where it meets no floor [m]

/// To a tenth of a millimetre: they are drawn.
ordered_json json_of(const Vector3d& p) {
  const auto rounded = [](double v) { return std::round(1e4 * v) / 1e4; };
  return {rounded(p.x()), rounded(p.y()), rounded(p.z())};
}

ordered_json arm_json(const RigConfig& rig, const JointVector& q) {
  ordered_json points{json_of(Vector3d::Zero())};
  for (const Transform& bMi : rig.arm.link_frames(q)) points.push_back(json_of(bMi.translation()));
  return points;
}

/// The projector's exit, and where the fan's edges meet the floor.
ordered_json sheet_json(const RigConfig& rig, const JointVector& q) {
  const Transform wMe = rig.obstacles.wMb * rig.arm.bMe(q), bMw = rig.obstacles.wMb.inverse();
  const Vector3d origin = wMe * rig.laser.origin_e, middle = wMe.linear() * rig.laser.direction_e;
  const Vector3d aside = (wMe.linear() * rig.laser.ePl.normal).cross(middle).normalized();
  ordered_json points{json_of(bMw * origin)};
  for (const double angle : {-0.5 * rig.laser.fan, 0.5 * rig.laser.fan}) {
    const Vector3d way = std::cos(angle) * middle + std::sin(angle) * aside;
    const double to_floor = way.z() < 0 ? origin.z() / -way.z() : kFarthest;
    points.push_back(json_of(bMw * Vector3d(origin + std::clamp(to_floor, 0.0, kFarthest) * way)));
  }
  return points;
}

ordered_json pose_json(const RigConfig& rig, const ScanPlan& plan, const Clearance& clearance, double t) {
  const Segment& segment = plan.segments()[plan.segment_at(t)];
  const JointVector q = plan.at(t).q;
  std::size_t nearest = 0;
  double least = clearance.at(0, q);
  for (std::size_t pair = 1; pair < clearance.pairs(); ++pair)
    if (const double found = clearance.at(pair, q); found < least) least = found, nearest = pair;
  return {{"t_s", std::round(1e3 * t) / 1e3}, {"segment", segment.name},
          {"laser", segment.laser},           {"arm", arm_json(rig, q)},
          {"sheet", sheet_json(rig, q)},      {"clearance_m", std::round(1e4 * least) / 1e4},
          {"pair", clearance.name(nearest)}};
}

/// Corners of the tank's inside, the floor's first.
ordered_json tank_json(const RigConfig& rig) {
  const Vector3d& size = rig.obstacles.tank_size;
  const Transform bMw = rig.obstacles.wMb.inverse();
  ordered_json corners = ordered_json::array();
  for (const double z : {0.0, size.z()})
    for (const auto& [x, y] : {std::pair{-0.5, -0.5}, std::pair{0.5, -0.5}, std::pair{0.5, 0.5}, std::pair{-0.5, 0.5}})
      corners.push_back(json_of(bMw * Vector3d(x * size.x(), y * size.y(), z)));
  return corners;
}

}  // namespace

ordered_json plan_drawing(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check) {
  const Obstacles obstacles = obstacles_of(rig);
  ordered_json out = scene_json(rig);
  out["tank"] = tank_json(rig);
  out["link_radius_m"] = rig.obstacles.link_radius;
  out["margin_m"] = rig.obstacles.margin;
  const Clearance clearance(rig.arm, obstacles);
  out["poses"] = ordered_json::array();
  for (int i = 0; i < kPoses; ++i)
    out["poses"].push_back(pose_json(rig, plan, clearance, plan.duration() * i / (kPoses - 1)));
  const Approach& nearest = check.nearest();
  const NearestPoints where = nearest_points(rig.arm, obstacles, nearest.pair, nearest.q);
  out["nearest"] = {{"t_s", nearest.when},
                    {"segment", nearest.segment},
                    {"clearance_m", nearest.clearance},
                    {"pair", nearest.pair},
                    {"points", {json_of(where.obstacle), json_of(where.body)}}};
  return out;
}

}  // namespace tankrig::app
