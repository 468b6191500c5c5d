#include "bench/metrics/peer_scores.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <nanoflann.hpp>
#include <tuple>

#include "bench/metrics/line_of_sight.hpp"
#include "bench/metrics/tree_points.hpp"

namespace tankrig {
namespace {

constexpr double kVoxel = 0.010;               // ETH3D's, of its averages [m]
constexpr double kBeamRadius = 0.5 * 0.00225;  // at the scanner [m]
const double kBeamSpread = std::tan(from_degrees(0.011));

class NearestPoints {
 public:
  explicit NearestPoints(const std::vector<Vector3d>& points) : points_{points}, tree_(3, points_) {}

  /// Infinity without points.
  double squared_distance(const Vector3d& p) const {
    if (points_.p.empty()) return std::numeric_limits<double>::infinity();
    std::size_t index = 0;
    double squared = 0;
    tree_.knnSearch(p.data(), 1, &index, &squared);
    return squared;
  }
  std::vector<std::size_t> within(const Vector3d& p, double radius) const {
    std::vector<std::pair<std::size_t, double>> found;
    if (!points_.p.empty()) tree_.radiusSearch(p.data(), radius * radius, found, nanoflann::SearchParams());
    std::vector<std::size_t> out;
    for (const auto& [index, squared] : found) out.push_back(index);
    return out;
  }

 private:
  TreePoints points_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, TreePoints>, TreePoints, 3, std::size_t>
      tree_;
};

using Voxel = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

Voxel voxel_of(const Vector3d& p, const Vector3d& origin, double size) {
  constexpr double kFar = 9e18;  // beyond it all is one
  const auto place = [&](int axis) {
    return static_cast<std::int64_t>(std::clamp(std::floor((p[axis] - origin[axis]) / size), -kFar, kFar));
  };
  return {place(0), place(1), place(2)};
}

/// A voxel's points become their mean. The grid begins half a voxel below the lowest point, as Open3D's does.
std::vector<Vector3d> thinned(const std::vector<Vector3d>& points, double size) {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (const Vector3d& p : points)
    if (p.allFinite()) low = low.cwiseMin(p);
  low.array() -= size / 2;
  std::map<Voxel, std::pair<Vector3d, double>> voxels;
  for (const Vector3d& p : points) {
    if (!p.allFinite()) continue;
    auto& [sum, count] = voxels.try_emplace(voxel_of(p, low, size), Vector3d::Zero(), 0).first->second;
    sum += p;
    ++count;
  }
  std::vector<Vector3d> out;
  for (const auto& [voxel, part] : voxels) out.push_back(part.first / part.second);
  return out;
}

/// Share of `points` nearer than tau to `others`.
double share_near(const std::vector<Vector3d>& points, const std::vector<Vector3d>& others, double tau) {
  const NearestPoints tree(others);
  const auto near =
      std::ranges::count_if(points, [&](const Vector3d& p) { return tree.squared_distance(p) < tau * tau; });
  return static_cast<double>(near) / static_cast<double>(points.size());
}

/// The mean over voxels of the share of good points in each, in two grids; 0 without points.
class VoxelShare {
 public:
  void add(const Vector3d& p, bool good) {
    for (int grid = 0; grid < 2; ++grid) {
      auto& [all, part] = voxels_[{grid, voxel_of(p, Vector3d::Constant(grid * kVoxel / 2), kVoxel)}];
      ++all;
      part += good;
    }
  }
  bool empty() const { return voxels_.empty(); }
  double mean() const {
    double sum = 0;
    for (const auto& [place, counts] : voxels_) sum += counts.second / counts.first;
    return voxels_.empty() ? 0 : sum / static_cast<double>(voxels_.size());
  }

 private:
  std::map<std::pair<int, Voxel>, std::pair<double, double>> voxels_;
};

double harmonic(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

enum class Seen { kAccurate, kInaccurate, kUnobserved };

/// One scan with its beams, found by their direction.
class Beams {
 public:
  explicit Beams(const TruthScan& scan) : scan_(scan), directions_(of(scan)), tree_(directions_) {}

  Seen judge(const Vector3d& p, double tolerance) const {
    const Vector3d ray = p - scan_.from;
    const double range = ray.norm();
    if (range == 0) return Seen::kUnobserved;
    const double radius = kBeamRadius + range * kBeamSpread;
    const double sine = std::min(1.0, radius / range);
    Seen seen = Seen::kUnobserved;
    for (const std::size_t i : tree_.within(ray / range, 2 * std::sin(std::asin(sine) / 2))) {
      const Vector3d& measured = scan_.points[i];
      if ((p - measured).squaredNorm() <= tolerance * tolerance) return Seen::kAccurate;
      if (range < (measured - scan_.from).norm()) seen = Seen::kInaccurate;
    }
    return seen;
  }

 private:
  static std::vector<Vector3d> of(const TruthScan& scan) {
    std::vector<Vector3d> out;
    for (const Vector3d& p : scan.points) out.push_back((p - scan.from).normalized());
    return out;
  }
  const TruthScan& scan_;
  std::vector<Vector3d> directions_;
  NearestPoints tree_;
};

}  // namespace

TanksAndTemplesScore tanks_and_temples_score(const std::vector<Vector3d>& cloud, const std::vector<Vector3d>& truth,
                                             double tau_m) {
  TanksAndTemplesScore score;
  score.tau_m = tau_m;
  const std::vector<Vector3d> points = thinned(cloud, tau_m / 2), surface = thinned(truth, tau_m / 2);
  score.points = points.size();
  score.truth_points = surface.size();
  if (points.empty() || surface.empty()) return score;
  score.precision = share_near(points, surface, tau_m);
  score.recall = share_near(surface, points, tau_m);
  score.f = harmonic(*score.precision, score.recall);
  return score;
}

Eth3dScore eth3d_score(const std::vector<Vector3d>& cloud, const std::vector<TruthScan>& scans, double tolerance_m) {
  Eth3dScore score;
  score.tolerance_m = tolerance_m;
  std::vector<Vector3d> finite;
  std::ranges::copy_if(cloud, std::back_inserter(finite), [](const Vector3d& p) { return p.allFinite(); });
  const NearestPoints tree(finite);
  VoxelShare complete, accurate;
  std::deque<Beams> beams;  // they stay where they are: their trees point into them
  for (const TruthScan& scan : scans) {
    beams.emplace_back(scan);
    for (const Vector3d& p : scan.points) complete.add(p, tree.squared_distance(p) <= tolerance_m * tolerance_m);
  }
  for (const Vector3d& p : finite) {
    Seen seen = Seen::kUnobserved;
    for (const Beams& scan : beams) seen = std::min(seen, scan.judge(p, tolerance_m));
    score.accurate += seen == Seen::kAccurate;
    score.inaccurate += seen == Seen::kInaccurate;
    score.unobserved += seen == Seen::kUnobserved;
    if (seen != Seen::kUnobserved) accurate.add(p, seen == Seen::kAccurate);
  }
  score.completeness = complete.mean();
  if (!accurate.empty()) score.accuracy = accurate.mean();
  score.f1 = harmonic(score.accuracy.value_or(0), score.completeness);
  return score;
}

TruthScan scan_of(const ObjectSurface& object, const Vector3d& from) {
  TruthScan scan{from, {}};
  const LineOfSight sight({&object.mesh()});
  for (const SurfaceSample& sample : object.samples()) {
    const Eigen::Vector3i& t = object.mesh().triangles[sample.triangle];
    const Vector3d &a = object.mesh().vertices[static_cast<std::size_t>(t[0])],
                   &b = object.mesh().vertices[static_cast<std::size_t>(t[1])],
                   &c = object.mesh().vertices[static_cast<std::size_t>(t[2])];
    const Vector3d normal = (b - a).cross(c - a).normalized(), towards = (from - sample.p).normalized();
    if (normal.dot(towards) <= 0) continue;
    constexpr double kClear = 1e-5;  // off the surface itself [m]
    if (sight.clear(sample.p + kClear * normal, from)) scan.points.push_back(sample.p);
  }
  return scan;
}

std::vector<Vector3d> above_ground(const PointCloud& cloud, const Metrics& metrics) {
  std::vector<Vector3d> out;
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    if (cloud.points[i].p.allFinite() && metrics.verdicts[i] != PointVerdict::kGround) out.push_back(cloud.points[i].p);
  return out;
}

}  // namespace tankrig
