// The arm's shape, and rays against it.
#include "sim_backends/world/arm_body.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig::sim {
namespace {

/// Distance along the ray at which it enters the capsule; nothing if it misses or starts inside.
std::optional<float> enter(const Capsule& c, const Vector3f& origin, const Vector3f& direction) {
  const Vector3f axis = c.b - c.a, from_a = origin - c.a;
  const float aa = axis.squaredNorm(), ad = axis.dot(direction), ao = axis.dot(from_a);
  const float od = from_a.dot(direction), oo = from_a.squaredNorm();
  const auto sphere = [&](const Vector3f& centre) -> std::optional<float> {
    const Vector3f m = origin - centre;
    const float b = m.dot(direction), disc = b * b - m.squaredNorm() + c.radius * c.radius;
    if (disc < 0) return std::nullopt;
    return -b - std::sqrt(disc);
  };
  const float qa = aa - ad * ad, qb = aa * od - ao * ad, qc = aa * oo - ao * ao - c.radius * c.radius * aa;
  if (qa < 1e-9f * aa || aa == 0) return sphere(ad < 0 ? c.b : c.a);
  const float disc = qb * qb - qa * qc;
  if (disc < 0) return std::nullopt;
  const float t = (-qb - std::sqrt(disc)) / qa, along = ao + t * ad;
  if (along > 0 && along < aa) return t;
  return sphere(along <= 0 ? c.a : c.b);
}

Vector3f normal_at(const Capsule& c, const Vector3f& p) {
  const Vector3f axis = c.b - c.a;
  const float length2 = axis.squaredNorm();
  const float s = length2 > 0 ? std::clamp(axis.dot(p - c.a) / length2, 0.0f, 1.0f) : 0.0f;
  return (p - c.a - s * axis).normalized();
}

}  // namespace

std::vector<Capsule> arm_bodies(const ArmSpec& arm, const LaserLine& laser, const JointVector& q) {
  const auto frames = arm.model.link_frames(q);
  const auto in_base = [&](const Vector3d& p) -> Vector3f { return (arm.wMb * p).cast<float>(); };
  const auto in_link = [&](int link, const Vector3d& p) -> Vector3f {
    return (arm.wMb * (frames[link] * p)).cast<float>();
  };
  const auto r = static_cast<float>(arm.link_radius);
  const Rgb metal{0.30f, 0.31f, 0.33f}, dark{0.07f, 0.07f, 0.08f};
  const double reach = arm.model.dh[3].d, wrist = -0.38 * reach, grip = -0.24 * reach;
  const double open = 0.02 + 0.05 * std::clamp(q[kJawOpening], 0.0, 1.4);

  std::vector<Capsule> bodies;
  bodies.push_back({in_base({0, 0, -0.13}), in_base({0, 0, 0.02}), 1.25f * r, metal});
  bodies.push_back({in_base({0, 0, 0}), in_link(0, {0, 0, 0}), r, arm.albedo});
  bodies.push_back({in_link(0, {0, 0, 0}), in_link(1, {0, 0, 0}), r, arm.albedo});
  bodies.push_back({in_link(0, {-0.02, 0.075, 0.03}), in_link(1, {-0.06, 0.06, 0.03}), 0.42f * r, metal});
  bodies.push_back({in_link(1, {0, 0, 0}), in_link(2, {0, 0, 0}), r, arm.albedo});
  bodies.push_back({in_link(2, {0, 0, 0}), in_link(3, {0, 0, wrist}), 0.9f * r, arm.albedo});
  bodies.push_back({in_link(3, {0, 0, wrist}), in_link(3, {0, 0, grip}), 0.7f * r, metal});
  for (const double side : {-1.0, 1.0}) {
    bodies.push_back({in_link(3, {0, 0, grip}), in_link(3, {0, side * open, 0.55 * grip}), 0.25f * r, metal});
    bodies.push_back(
        {in_link(3, {0, side * open, 0.55 * grip}), in_link(3, {0, 0.3 * side * open, -0.015}), 0.2f * r, metal});
  }
  const Transform wMl = arm.wMb * frames[3] * laser.eMl;
  const Vector3d back = wMl * Vector3d(0, 0, -0.13);
  bodies.push_back({(wMl * Vector3d(0, 0, -0.022)).cast<float>(), back.cast<float>(), 0.021f, dark, true});
  bodies.push_back({back.cast<float>(), in_link(3, {0, 0, wrist}), 0.009f, metal, true});
  return bodies;
}

std::optional<BodyHit> intersect(const std::vector<Capsule>& bodies, const Vector3f& origin,
                                 const Vector3f& unit_direction, float from, float to) {
  std::optional<BodyHit> nearest;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto t = enter(bodies[i], origin, unit_direction);
    if (!t || *t <= from || *t >= to) continue;
    to = *t;
    nearest = BodyHit{*t, Vector3f::UnitZ(), static_cast<int>(i)};
  }
  if (nearest) nearest->normal = normal_at(bodies[nearest->part], origin + nearest->distance * unit_direction);
  return nearest;
}

}  // namespace tankrig::sim
