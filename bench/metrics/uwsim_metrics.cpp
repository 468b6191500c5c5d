#include "bench/metrics/uwsim_metrics.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

/// Nodes on a box, `step` apart along each axis.
class Lattice {
 public:
  Lattice(const Eigen::AlignedBox3d& box, double level_of_detail) : corner_(box.min()) {
    for (int axis = 0; axis < 3; ++axis) {
      const double length = box.sizes()[axis];
      const double cells = std::floor(length / level_of_detail);
      if (!(cells >= 1))
        throw InputError(
            fmt::format("level of detail {:f} m, expected at most the box edge {:f} m", level_of_detail, length));
      step_[axis] = level_of_detail + std::fmod(length, level_of_detail) / cells;
      size_[axis] = static_cast<int>(length / step_[axis]) + 1;
    }
    marked_.resize(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
  }

  void mark_around(const Vector3d& p) {
    const Vector3d at = (p - corner_).cwiseQuotient(step_);
    for (int corner = 0; corner < 8; ++corner) {
      std::array<int, 3> node{};
      bool inside = true;
      for (int axis = 0; axis < 3; ++axis) {
        const double rounded = corner >> axis & 1 ? std::ceil(at[axis]) : std::floor(at[axis]);
        inside = inside && rounded >= 0 && rounded < size_[axis];
        node[axis] = inside ? static_cast<int>(rounded) : 0;
      }
      if (inside) mark(node);
    }
  }

  const std::array<int, 3>& size() const { return size_; }
  int counted() const { return counted_; }

  int denominator() const {
    const auto [x, y, z] = size_;
    return 2 * x * y + x * z + 2 * y * z - 2 * x - 4 * y - 2 * z + 4;
  }

 private:
  void mark(const std::array<int, 3>& node) {
    const std::size_t index = (static_cast<std::size_t>(node[0]) * size_[1] + node[1]) * size_[2] + node[2];
    const bool on_side = node[0] == 0 || node[0] == size_[0] - 1 || node[1] == 0 || node[1] == size_[1] - 1;
    const bool on_top = node[2] == size_[2] - 1;
    if (!marked_[index] && (on_side || on_top)) ++counted_;
    marked_[index] = true;
  }

  Vector3d corner_;
  Vector3d step_ = Vector3d::Zero();
  std::array<int, 3> size_{};
  std::vector<bool> marked_;
  int counted_ = 0;
};

double surface_distance(const Eigen::AlignedBox3d& box, const Vector3d& p) {
  const double to_planes = std::min((p - box.min()).cwiseAbs().minCoeff(), (p - box.max()).cwiseAbs().minCoeff());
  return std::max(box.exteriorDistance(p), to_planes);
}

Eigen::AlignedBox3d rounded_to_um(const Eigen::AlignedBox3d& box) {
  const auto round = [](double x) { return std::round(x * 1e6) / 1e6; };
  return {Vector3d(box.min().unaryExpr(round)), Vector3d(box.max().unaryExpr(round))};
}

}  // namespace

const std::vector<std::string>& uwsim_oddities() {
  static const std::vector<std::string> oddities{
      "distance is to the axis-aligned box of the mesh, not to the mesh",
      "errors up to 0.15 m count as inliers and enter the mean",
      "ground is whatever is nearer to the box's bottom plane than to the box, up to 0.10 m from that plane",
      "the spread is a variance, not a standard deviation",
      "coverage counts lattice nodes; every point, ground and outliers too, marks the up to 8 nodes around it",
      "the coverage denominator leaves out one x-z side and has both x-y faces: a perfect cloud may not read 100 %",
      "the number of lattice nodes depends on rounding; box corners are rounded to 1 um here",
      "an empty cloud scores mean error 0 and outliers 0",
  };
  return oddities;
}

UwsimMetrics uwsim_metrics(const PointCloud& cloud, const TriangleMesh& mesh, double level_of_detail_m) {
  const Eigen::AlignedBox3d box = rounded_to_um(mesh.bounds());
  Lattice lattice(box, level_of_detail_m);
  UwsimMetrics m;
  m.level_of_detail_m = level_of_detail_m;
  m.points = cloud.points.size();
  double squared_deviations = 0;
  for (const CloudPoint& point : cloud.points) {
    if (!point.p.allFinite()) continue;
    const double distance = surface_distance(box, point.p);
    const double above_ground = std::abs(box.min().z() - point.p.z());
    if (above_ground < distance && above_ground <= kUwsimGroundBand) {
      ++m.ground_points;
    } else if (distance >= kUwsimOutlier) {
      ++m.outlier_count;
    } else {
      ++m.inliers;
      const double delta = distance - m.mean_error_m;
      m.mean_error_m += delta / static_cast<double>(m.inliers);
      squared_deviations += delta * (distance - m.mean_error_m);
    }
    lattice.mark_around(point.p);
  }
  m.error_variance_m2 = squared_deviations / (static_cast<double>(m.inliers) - 1.0);
  if (m.outlier_count > 0)
    m.outliers = static_cast<double>(m.outlier_count) / static_cast<double>(m.inliers + m.outlier_count);
  m.lattice = lattice.size();
  m.marked_nodes = lattice.counted();
  m.denominator = lattice.denominator();
  m.coverage = static_cast<double>(m.marked_nodes) / m.denominator;
  return m;
}

}  // namespace tankrig
