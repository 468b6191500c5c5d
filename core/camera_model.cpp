#include "core/camera_model.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/angles.hpp"

namespace tankrig {
namespace {

/// Distorts (x, y) and gives the 2x2 Jacobian of the distorted point.
Vector2d distort(const CameraModel& c, const Vector2d& p, Eigen::Matrix2d* jacobian) {
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  if (jacobian) {
    const double dr = c.k1 + r2 * (2 * c.k2 + 3 * r2 * c.k3);  // d radial / d r2
    (*jacobian)(0, 0) = radial + 2 * x * x * dr + 2 * c.p1 * y + 6 * c.p2 * x;
    (*jacobian)(0, 1) = 2 * x * y * dr + 2 * c.p1 * x + 2 * c.p2 * y;
    (*jacobian)(1, 0) = (*jacobian)(0, 1);
    (*jacobian)(1, 1) = radial + 2 * y * y * dr + 6 * c.p1 * y + 2 * c.p2 * x;
  }
  return {x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x),
          y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y};
}

}  // namespace

std::optional<Vector2d> CameraModel::project(const Vector3d& p) const {
  Vector3d seen = p;
  if (port && !seen_through(*port, port->distance, port->normal, p, seen)) return std::nullopt;
  if (!(seen.z() > 1e-9)) return std::nullopt;
  const Vector2d d = distort(*this, {seen.x() / seen.z(), seen.y() / seen.z()}, nullptr);
  return Vector2d{fx * d.x() + cx, fy * d.y() + cy};
}

Vector2d CameraModel::normalized(double u, double v) const {
  const Vector2d target{(u - cx) / fx, (v - cy) / fy};
  Vector2d p = target;
  for (int i = 0; i < 30; ++i) {
    Eigen::Matrix2d jacobian;
    const Vector2d residual = distort(*this, p, &jacobian) - target;
    const Vector2d step = jacobian.inverse() * residual;
    p -= step;
    if (step.squaredNorm() < 1e-26) break;
  }
  return p;
}

Vector2d CameraModel::normalized(double u, double v, double depth) const {
  if (!port) return normalized(u, v);
  const ViewingRay ray = sight(u, v);
  return ray.at((depth - ray.origin.z()) / ray.direction.z()).hnormalized();
}

ViewingRay CameraModel::sight(double u, double v) const {
  const Vector2d p = normalized(u, v);
  const Vector3d direction = Vector3d{p.x(), p.y(), 1.0}.normalized();
  return port ? port->beyond(direction) : ViewingRay{Vector3d::Zero(), direction};
}

bool CameraModel::invertible() const {
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const Vector2d pixel(i * (width - 1.0) / kSteps, j * (height - 1.0) / kSteps);
      const Vector2d p = normalized(pixel.x(), pixel.y());
      Eigen::Matrix2d jacobian;
      const Vector2d d = distort(*this, p, &jacobian);
      const Vector2d back(fx * d.x() + cx, fy * d.y() + cy);
      if (!((back - pixel).norm() < 1e-6) || !(jacobian.determinant() > 0) || !(p.norm() < 100)) return false;
    }
  return true;
}

bool CameraModel::looks_through_port() const {
  if (!port) return true;
  constexpr int kSteps = 16;
  const double least = std::cos(from_degrees(85));
  const auto looks = [&](double across, double down) {
    const Vector2d p = normalized(across * width - 0.5, down * height - 0.5);
    return port->normal.dot(p.homogeneous().normalized()) > least;
  };
  // The angle to the normal is largest on the image's border.
  for (int i = 0; i <= kSteps; ++i) {
    const double along = static_cast<double>(i) / kSteps;
    if (!looks(along, 0) || !looks(along, 1) || !looks(0, along) || !looks(1, along)) return false;
  }
  return true;
}

}  // namespace tankrig
