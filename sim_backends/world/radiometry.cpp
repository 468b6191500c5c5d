// Lamps, ambient light and interreflection.
#include "sim_backends/world/radiometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::sim {
namespace {

constexpr float kSkin = 1e-4f;  ///< rays leave a surface this far above it [m]
constexpr float kSkyAtSurfaces =
    0.3f;  ///< of the downwelling light, half of what a typical surface in the tank receives

/// Exponent k with cos(half_angle)^k = 0.1.
float cosine_power(double half_angle) {
  const double c = std::cos(std::min(half_angle, 1.55));
  return static_cast<float>(std::log(0.1) / std::log(std::min(c, 1 - 1e-9)));
}

/// Two unit vectors that make a right-handed frame with `n`.
void tangents(const Vector3f& n, Vector3f& a, Vector3f& b) {
  a = (std::abs(n.z()) < 0.9f ? Vector3f::UnitZ() : Vector3f::UnitX()).cross(n).normalized();
  b = n.cross(a);
}

}  // namespace

Radiometry::Radiometry(const Scene& scene, const RenderGeometry& geometry)
    : geometry_(&geometry),
      attenuation_(scene.water.attenuation),
      backscatter_(scene.water.backscatter),
      veil_(scene.water.veil),
      ambient_(Rgb::Constant(static_cast<float>(scene.ambient_lux))),
      water_depth_(static_cast<float>(scene.tank.water_depth)) {
  const Vector3f size = scene.tank.size.cast<float>();
  const float floor_area = size.x() * size.y();
  const float wall_area = 2 * water_depth_ * (size.x() + size.y());
  Rgb flux = ambient_ * floor_area;
  for (const Lamp& lamp : scene.lamps) {
    const Source source{lamp.position.cast<float>(), lamp.direction.normalized().cast<float>(),
                        lamp.colour * static_cast<float>(lamp.candela), cosine_power(lamp.half_angle)};
    sources_.push_back(source);
    flux += source.candela * (2 * std::numbers::pi_v<float> / (source.power + 1));
  }
  // The water surface gives nothing back. ambient() follows the first reflection itself.
  const float area = 2 * floor_area + wall_area;
  const Rgb albedo = (scene.tank.floor.albedo * floor_area + scene.tank.walls.albedo * wall_area) / area;
  const Rgb once = transmission(water_depth_);
  first_reflected_ = flux * once * albedo / area;
  reflected_ = first_reflected_ * albedo * once / (1 - albedo * once);
}

Rgb Radiometry::from_source(const Source& source, float distance, float cos_axis) const {
  if (cos_axis <= 0) return Rgb::Zero();
  return source.candela * (std::pow(cos_axis, source.power) / (distance * distance)) * transmission(distance);
}

Rgb Radiometry::direct(const Vector3f& p, const Vector3f& normal) const {
  Rgb sum = Rgb::Zero();
  for (const Source& source : sources_) {
    const Vector3f to = source.position - p;
    const float distance = to.norm();
    const Vector3f direction = to / distance;
    const float cos_incidence = normal.dot(direction);
    if (cos_incidence <= 0) continue;
    const Rgb e = from_source(source, distance, -source.axis.dot(direction));
    if (e.maxCoeff() <= 0 || geometry_->occluded(p + kSkin * normal, direction, 0, distance)) continue;
    sum += e * cos_incidence;
  }
  return sum;
}

Rgb Radiometry::facing_lamps(const Vector3f& p) const {
  Rgb sum = Rgb::Zero();
  for (const Source& source : sources_) {
    const Vector3f to = source.position - p;
    const float distance = std::max(to.norm(), 0.02f);
    sum += from_source(source, distance, -source.axis.dot(to) / distance);
  }
  return sum;
}

Rgb Radiometry::ambient(const Vector3f& p, const Vector3f& normal, int side) const {
  Vector3f a, b;
  tangents(normal, a, b);
  const Vector3f origin = p + kSkin * normal;
  Rgb sum = Rgb::Zero();
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const std::uint64_t h = mix(static_cast<std::uint64_t>(i * side + j));
      const float s = (static_cast<float>(i) + static_cast<float>(h & 0xffff) * 0x1p-16f) / static_cast<float>(side);
      const float t =
          (static_cast<float>(j) + static_cast<float>((h >> 16) & 0xffff) * 0x1p-16f) / static_cast<float>(side);
      const float radius = std::sqrt(s), angle = 2 * std::numbers::pi_v<float> * t;
      const Vector3f direction =
          radius * std::cos(angle) * a + radius * std::sin(angle) * b + std::sqrt(1 - s) * normal;
      const auto hit = geometry_->intersect(origin, direction);
      const bool upward = direction.z() > 1e-4f;
      const float to_surface = upward ? std::max(0.0f, (water_depth_ - origin.z()) / direction.z()) : 0;
      if (upward && !(hit && hit->distance < to_surface))
        sum += ambient_ * transmission(to_surface);
      else if (hit)
        sum += geometry_->surface(hit->surface).material.albedo *
               (direct(hit->p, hit->normal) + kSkyAtSurfaces * (1 + hit->normal.z()) * downwelling(hit->p)) *
               transmission(hit->distance);
    }
  return sum / static_cast<float>(side * side) + reflected_;
}

Rgb Radiometry::downwelling(const Vector3f& p) const {
  return ambient_ * transmission(std::max(0.0f, water_depth_ - p.z()));
}

Rgb Radiometry::open_water(const Vector3f& p) const { return downwelling(p) + reflected_ + first_reflected_; }

}  // namespace tankrig::sim
