// The flat window of a camera's housing: air inside, a pane, water outside.
#pragma once

#include <cmath>
#include <optional>
#include <type_traits>

#include "core/frames.hpp"

namespace tankrig {

/// A line of sight, from where light enters the water: the points origin + range * direction, range > 0.
struct ViewingRay {
  Vector3d origin = Vector3d::Zero();      ///< the camera's without a port
  Vector3d direction = Vector3d::UnitZ();  ///< unit

  Vector3d at(double range) const { return origin + range * direction; }
};
inline ViewingRay operator*(const Transform& aMb, const ViewingRay& ray) {
  return {aMb * ray.origin, aMb.linear() * ray.direction};
}

/// A camera behind it has no single viewpoint: its lines of sight meet the line through c's origin along `normal`.
/// Frames: camera c, whose origin is the lens's viewpoint.
/// Source: Agrawal, Ramalingam, Taguchi, Chari 2012 (a flat port is an axial camera).
struct FlatPort {
  double distance = 0;                          ///< of the inner face from c's origin [m]
  double thickness = 0;                         ///< of the pane [m]
  Vector3d normal = Vector3d::UnitZ();          ///< unit, towards the water
  double air = 1, glass = 1.49, water = 1.333;  ///< refractive indices; air's is the smallest

  /// The line of sight in the water that comes in along `air_direction` (unit, within 90 degrees of the normal).
  ViewingRay beyond(const Vector3d& air_direction) const;
};

namespace detail {

/// With m the tangent of the angle in air over p's distance r from the port's axis, Snell's law adds up to
///   m (d + g / sqrt(ng^2 + (ng^2 - 1) m^2 r^2) + h / sqrt(nw^2 + (nw^2 - 1) m^2 r^2)) = 1,
/// indices relative to air. Newton's step from m.
template <class T>
T port_step(const FlatPort& port, const T& distance, const T& depth, const T& r2, double m) {
  using std::sqrt;
  const double glass2 = port.glass * port.glass / (port.air * port.air),
               water2 = port.water * port.water / (port.air * port.air);
  const T t2 = m * m * r2, in_glass = glass2 + (glass2 - 1) * t2, in_water = water2 + (water2 - 1) * t2;
  const T glass_way = port.thickness / sqrt(in_glass), water_way = depth / sqrt(in_water);
  return (1.0 - m * (distance + glass_way + water_way)) /
         (distance + glass_way * glass2 / in_glass + water_way * water2 / in_water);
}

/// The left side grows and is concave, and is at most 1 at the first m: the steps climb to the root and cannot pass it.
inline std::optional<double> port_root(const FlatPort& port, double distance, double depth, double r2) {
  constexpr int kMostSteps = 100;
  double m = 1 / (distance + port.thickness * port.air / port.glass + depth * port.air / port.water);
  for (int i = 0; i < kMostSteps; ++i) {
    const double step = port_step(port, distance, depth, r2, m);
    m += step;
    if (!(step > 1e-15 * m)) return m;
  }
  return std::nullopt;
}

}  // namespace detail

/// In which direction, inside, the point p in the water is seen: `air_direction`, of any length. False if p is not
/// beyond the pane. `distance` and `normal` stand in for the port's own, of any scalar that Ceres differentiates by.
template <class T>
bool seen_through(const FlatPort& port, const T& distance, const Eigen::Matrix<T, 3, 1>& normal,
                  const Eigen::Matrix<T, 3, 1>& p, Eigen::Matrix<T, 3, 1>& air_direction) {
  const auto value = [](const T& x) -> double {
    if constexpr (std::is_same_v<T, double>)
      return x;
    else
      return x.a;
  };
  const T height = normal.dot(p), depth = height - distance - port.thickness;
  if (!(value(depth) > 0)) return false;
  const Eigen::Matrix<T, 3, 1> across = p - height * normal;
  const T r2 = across.squaredNorm();
  const auto root = detail::port_root(port, value(distance), value(depth), value(r2));
  if (!root) return false;
  // At the root a step is zero; its derivatives are the root's.
  const T m = *root + detail::port_step(port, distance, depth, r2, *root);
  air_direction = normal + m * across;
  return true;
}

}  // namespace tankrig
