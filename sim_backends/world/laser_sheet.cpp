// Fan profile, section and shadows of the laser sheet.
#include "sim_backends/world/laser_sheet.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tankrig::sim {
namespace {

constexpr double kFlatShare = 0.9;  ///< of the fan's half angle; a smooth edge of the rest

float smooth(float t) { return t * t * (3 - 2 * t); }

}  // namespace

SheetPose::SheetPose(const Transform& wMl)
    : exit(wMl.translation().cast<float>()),
      normal(wMl.linear().col(0).cast<float>()),
      across(wMl.linear().col(1).cast<float>()),
      forward(wMl.linear().col(2).cast<float>()) {}

LaserSheet::LaserSheet(const LaserLine& line, float attenuation)
    : half_width_(static_cast<float>(line.half_width)),
      divergence_(static_cast<float>(line.divergence)),
      attenuation_(attenuation),
      // The smooth edge integrates to half its width.
      lumen_per_rad_(static_cast<float>(line.power_lm / (line.fan * (1 + kFlatShare) / 2))),
      tan_flat_(static_cast<float>(std::tan(kFlatShare * line.fan / 2))),
      tan_edge_(static_cast<float>(std::tan(line.fan / 2))),
      flat_(static_cast<float>(kFlatShare * line.fan / 2)),
      edge_(static_cast<float>(line.fan / 2)) {}

float LaserSheet::line_density(float range, float tan_angle) const {
  const float t = std::abs(tan_angle);
  if (t >= tan_edge_) return 0;
  const float profile = t <= tan_flat_ ? 1.0f : 1 - smooth((std::atan(t) - flat_) / (edge_ - flat_));
  return profile * lumen_per_rad_ / range * std::exp(-attenuation_ * range);
}

float LaserSheet::illuminance(float range, float tan_angle, float x, float extra_variance) const {
  const float s = sigma(range), variance = s * s + extra_variance;
  constexpr float kNorm = 0.3989422804f;  // 1 / sqrt(2 pi)
  return line_density(range, tan_angle) * kNorm / std::sqrt(variance) * std::exp(-0.5f * x * x / variance);
}

bool laser_reaches(const SheetPose& pose, const Vector3f& p, const Vector3f& normal, const RenderGeometry& geometry,
                   const std::vector<Capsule>& blockers) {
  const Vector3f to = p + 2e-4f * normal - pose.exit;
  const float range = to.norm();
  const Vector3f direction = to / range;
  return !geometry.occluded(pose.exit, direction, kExitClearance, range) &&
         !(!blockers.empty() && intersect(blockers, pose.exit, direction, kExitClearance, range));
}

std::vector<Capsule> bodies_in_sheet(const std::vector<Capsule>& bodies, const SheetPose& pose) {
  std::vector<Capsule> near;
  for (const Capsule& c : bodies) {
    if (c.projector) continue;
    const float a = pose.distance(c.a), b = pose.distance(c.b), reach = c.radius + 0.005f;
    const bool crosses = std::min(a, b) < reach && std::max(a, b) > -reach;
    const bool ahead = std::max(pose.forward.dot(c.a - pose.exit), pose.forward.dot(c.b - pose.exit)) > -c.radius;
    if (crosses && ahead) near.push_back(c);
  }
  return near;
}

}  // namespace tankrig::sim
