#include "calibration/intrinsics/projection_uncertainty.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "calibration/estimate/rotation_vector.hpp"

namespace tankrig {
namespace {

Vector2d pixel_of(const CameraModel& size, const CameraParameters& parameters, const Vector3d& p) {
  return camera_of(size, parameters).project(p).value();
}

double worst(const Eigen::Matrix2d& variance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(variance);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
}

}  // namespace

std::optional<ProjectionUncertainty::At> ProjectionUncertainty::at(const Vector2d& pixel, double distance) const {
  const CameraModel& camera = solution_.camera;
  const Vector3d p = camera.sight(pixel.x(), pixel.y()).at(distance);
  const auto back = camera.project(p);
  if (!back || !((*back - pixel).norm() < 1e-3)) return std::nullopt;
  const BundleLayout& layout = solution_.covariance.layout;
  Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(2, layout.size);
  const CameraParameters values = parameters_of({camera});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const int at = layout.cameras.front()[i];
    if (at < 0) continue;
    const double step = 1e-6 * std::max(1.0, std::abs(values[i]));
    CameraParameters up = values, down = values;
    up[i] += step, down[i] -= step;
    slope.col(at) = (pixel_of(camera, up, p) - pixel_of(camera, down, p)) / (2 * step);
  }
  if (const int at = layout.ports.front(); at >= 0)
    for (int i = 0; i < kPortParameters; ++i) {
      constexpr double kStep = 1e-6;
      RationalCamera up{camera}, down{camera};
      PortParameters more = parameters_of(*camera.port), less = more;
      more[static_cast<std::size_t>(i)] += kStep, less[static_cast<std::size_t>(i)] -= kStep;
      up.port = port_of(*camera.port, more), down.port = port_of(*camera.port, less);
      slope.col(at + i) = (up.project(p).value() - down.project(p).value()) / (2 * kStep);
    }
  Eigen::Matrix<double, 2, 3> by_point;
  for (int i = 0; i < 3; ++i) {
    const Vector3d step = 1e-6 * distance * Vector3d::Unit(i);
    by_point.col(i) = (pixel_of(camera, values, p + step) - pixel_of(camera, values, p - step)) / (2e-6 * distance);
  }
  const double share = 1 / double(layout.views.size());
  for (std::size_t v = 0; v < layout.views.size(); ++v) {
    const Transform& cMt = solution_.bundle.cMt[v];
    const Eigen::AngleAxisd turn(cMt.rotation());
    const Vector3d arm = p - cMt.translation();
    slope.middleCols<3>(layout.views[v]) = -share * by_point * cross(arm) * left_jacobian(turn.angle() * turn.axis());
    slope.middleCols<3>(layout.views[v] + 3) = share * by_point;
  }
  const Eigen::Matrix2d variance = slope * solution_.covariance.matrix * slope.transpose();
  const double noise = solution_.noise.sigma, sigma = noise * solution_.noise.allowance;
  const Eigen::Matrix2d across = by_point.leftCols<2>().inverse();
  return At{sigma * worst(variance), noise * worst(variance), sigma * worst(across * variance * across.transpose())};
}

}  // namespace tankrig
