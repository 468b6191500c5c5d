// What object pose needs of a mesh: its sharp edges, what hides what, and its surface.
#pragma once

#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Frames: o.
/// Units: metres.
class ObjectShape {
 public:
  /// Edge that an eye sees as a line: of one triangle, or of two that meet at more than 20 degrees.
  struct Edge {
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
  };

  ObjectShape(std::vector<Vector3d> vertices, std::vector<Eigen::Vector3i> triangles);

  const std::vector<Edge>& edges() const { return edges_; }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }
  double size() const { return bounds_.diagonal().norm(); }

  /// Whether the straight way from `p` on the surface to `eye` is free; what touches `p` itself does not hide it.
  bool sees(const Vector3d& eye, const Vector3d& p) const;

  /// Root mean square over the whole surface of how far a small motion takes it along its normal. `covariance` is that of the motion:
  /// a rotation vector about the axes of o, then a translation [rad, m].
  struct SurfaceError {
    double rms = 0, most = 0;  ///< [m]
  };
  SurfaceError surface_error(const Eigen::Matrix<double, 6, 6>& covariance) const;

 private:
  std::vector<Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Edge> edges_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace tankrig
