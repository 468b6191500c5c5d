#include "calibration/laser_plane/laser_plane.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/laser_plane/sheet_ransac.hpp"
#include "core/input_error.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kLeastSigma = 1e-6;  // [m]
constexpr std::size_t kLeastGroups = 3;
constexpr std::size_t kLeastPoints = 30;  // on the plane
constexpr double kLeastShare = 0.3;       // of the points that must lie on one plane
constexpr double kThinnest = 0.02;        // of the extent across over the extent along
constexpr double kGross = 4;              // standard deviations beyond which a point is no inlier
constexpr int kRounds = 5;

double weight_of(const SheetPoint& point) { return 1 / std::pow(std::max(point.sigma, kLeastSigma), 2); }

/// Weighted total least squares.
struct Fit {
  Vector3d centre = Vector3d::Zero();
  Vector3d u, v, normal;
  double along = 0, across = 0;  ///< root mean square extents along v and u

  Plane plane() const { return {normal, -normal.dot(centre)}; }
};

Fit fit(const std::vector<SheetPoint>& points, const std::vector<bool>& use) {
  Fit f;
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (use[i]) f.centre += weight_of(points[i]) * points[i].p, sum += weight_of(points[i]);
  f.centre /= sum;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!use[i]) continue;
    const Vector3d d = points[i].p - f.centre;
    scatter += weight_of(points[i]) / sum * d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  f.normal = eigen.eigenvectors().col(0);
  Eigen::Index largest;
  f.normal.cwiseAbs().maxCoeff(&largest);
  if (f.normal[largest] < 0) f.normal = -f.normal;
  f.v = eigen.eigenvectors().col(2);
  f.u = f.v.cross(f.normal);
  f.across = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
  f.along = std::sqrt(eigen.eigenvalues()[2]);
  return f;
}

/// Of a point's distance from the plane with respect to the tilts and the distance at the centre.
Vector3d row(const Fit& f, const Vector3d& p) { return {f.u.dot(p - f.centre), f.v.dot(p - f.centre), 1}; }

/// Normal equations of one group's inliers.
struct Sums {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();  ///< weighted residuals
};

std::vector<Sums> sums_of(const LaserPlaneProblem& problem, const Fit& f, const std::vector<bool>& use) {
  std::vector<Sums> sums(problem.groups.size());
  const Plane plane = f.plane();
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    if (!use[i]) continue;
    const SheetPoint& point = problem.points[i];
    const Vector3d j = row(f, point.p);
    Sums& s = sums[static_cast<std::size_t>(point.group)];
    s.information += weight_of(point) * j * j.transpose();
    s.gradient += weight_of(point) * plane.distance(point.p) * j;
  }
  return sums;
}

/// Sandwich with groups as witnesses, and never below what independent points would give.
Eigen::Matrix3d covariance_of(const std::vector<Sums>& sums, double variance_factor) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero(), meat = Eigen::Matrix3d::Zero();
  double groups = 0;
  for (const Sums& s : sums) {
    if (s.information(2, 2) <= 0) continue;
    information += s.information;
    ++groups;
  }
  const Eigen::Matrix3d bread = information.inverse();
  for (const Sums& s : sums) {
    // What a group alone says of the plane, with the share of the fit that follows it taken off (HC3).
    const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - s.information * bread;
    const Vector3d gradient = rest.fullPivLu().solve(s.gradient);
    meat += gradient * gradient.transpose();
  }
  Eigen::Matrix3d covariance = (groups - 1) / groups * bread * meat * bread;
  const Eigen::Matrix3d independent = variance_factor * bread;
  for (int k = 0; k < 3; ++k)
    if (covariance(k, k) < independent(k, k)) {
      const double scale = std::sqrt(independent(k, k) / std::max(covariance(k, k), 1e-300));
      covariance.row(k) *= scale;
      covariance.col(k) *= scale;
    }
  return covariance;
}

void check(const LaserPlaneProblem& problem) {
  if (problem.points.empty())
    throw InputError("laser plane: found no stripe points, expected pictures in which the stripe is seen");
  std::set<int> groups;
  for (const SheetPoint& point : problem.points) groups.insert(point.group);
  if (groups.size() < kLeastGroups)
    throw InputError(
        fmt::format("laser plane: found the stripe in {} pictures or postures, expected at least {}: one "
                    "straight stripe does not tell a plane",
                    groups.size(), kLeastGroups));
}

void check_extent(const Fit& f) {
  if (f.across >= kThinnest * f.along) return;
  throw InputError(
      fmt::format("laser plane: found all stripe points near one line ({:.1f} mm across, {:.0f} mm along), expected "
                  "boards or postures at several distances",
                  1e3 * f.across, 1e3 * f.along));
}

/// Inliers of the consensus, then of repeated fits: what lies within a few root mean squares.
std::vector<bool> inliers_of(const LaserPlaneProblem& problem) {
  check_extent(fit(problem.points, std::vector<bool>(problem.points.size(), true)));
  std::vector<Vector3d> places;
  for (const SheetPoint& point : problem.points) places.push_back(point.p);
  const auto consensus = ransac_plane(places, problem.inlier_distance);
  if (!consensus) throw InputError("laser plane: found no plane through the stripe points, expected one");
  std::vector<bool> use(problem.points.size());
  Plane plane = *consensus;
  double reach = problem.inlier_distance;
  for (int round = 0; round < kRounds; ++round) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < use.size(); ++i) {
      use[i] = std::abs(plane.distance(places[i])) <= reach;
      count += use[i];
    }
    if (count < std::max(kLeastPoints, static_cast<std::size_t>(kLeastShare * static_cast<double>(use.size()))))
      throw InputError(fmt::format("laser plane: found {} of {} stripe points on one plane, expected at least {}",
                                   count, use.size(), kLeastPoints));
    plane = fit(problem.points, use).plane();
    std::vector<double> distances;
    for (std::size_t i = 0; i < use.size(); ++i)
      if (use[i]) distances.push_back(std::abs(plane.distance(places[i])));
    const double robust_sigma = 1.4826 * upper_median(distances);
    reach = std::min(problem.inlier_distance, std::max(kGross * robust_sigma, 10 * kLeastSigma));
  }
  return use;
}

void slope_over_elbow(const LaserPlaneProblem& problem, LaserPlaneSolution& s) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (std::size_t g = 0; g < s.groups.size(); ++g) {
    if (!problem.groups[g].elbow || s.groups[g].inliers == 0) continue;
    const double x = *problem.groups[g].elbow, y = s.groups[g].mean;
    ++n, sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y;
  }
  const double spread = sxx - sx * sx / n;
  if (n < 4 || !(spread > 1e-6)) return;
  const double slope = (sxy - sx * sy / n) / spread;
  const double left = std::max(0.0, syy - sy * sy / n - slope * slope * spread);
  s.slope = slope;
  s.slope_sigma = std::sqrt(left / (n - 2) / spread);
}

}  // namespace

double LaserPlaneSolution::sigma_at(const Vector3d& p) const {
  const Vector3d j{axis_u.dot(p - centre), axis_v.dot(p - centre), 1};
  return std::sqrt(j.dot(covariance * j));
}

LaserPlaneSolution solve(const LaserPlaneProblem& problem) {
  check(problem);
  LaserPlaneSolution s;
  s.inlier = inliers_of(problem);
  const Fit f = fit(problem.points, s.inlier);
  check_extent(f);
  s.plane = f.plane();
  s.centre = f.centre, s.axis_u = f.u, s.axis_v = f.v;

  s.groups.resize(problem.groups.size());
  double squares = 0, weighted = 0, count = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const double r = s.plane.distance(problem.points[i].p);
    s.residuals.push_back(r);
    SheetGroupFit& group = s.groups[static_cast<std::size_t>(problem.points[i].group)];
    ++group.points;
    if (!s.inlier[i]) continue;
    ++group.inliers, ++count;
    group.mean += r, group.rms += r * r;
    squares += r * r, weighted += r * r * weight_of(problem.points[i]);
  }
  for (SheetGroupFit& group : s.groups) {
    if (group.inliers == 0) continue;
    group.mean /= static_cast<double>(group.inliers);
    group.rms = std::sqrt(group.rms / static_cast<double>(group.inliers));
  }
  s.rms = std::sqrt(squares / count);
  s.inlier_share = count / static_cast<double>(problem.points.size());

  const std::vector<Sums> sums = sums_of(problem, f, s.inlier);
  s.covariance = covariance_of(sums, weighted / std::max(1.0, count - 3));
  s.sigma_rad = std::sqrt(std::max(s.covariance(0, 0), s.covariance(1, 1)));
  s.sigma_m = std::sqrt(s.covariance(2, 2));

  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const Sums& sum : sums) information += sum.information;
  double held_back = 0;
  std::vector<Vector3d> without(sums.size(), Vector3d::Zero());  // how the plane moves without each group
  for (std::size_t g = 0; g < sums.size(); ++g)
    without[g] = (information - sums[g].information).ldlt().solve(sums[g].gradient);
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    if (!s.inlier[i]) continue;
    const auto g = static_cast<std::size_t>(problem.points[i].group);
    held_back += std::pow(s.residuals[i] + row(f, problem.points[i].p).dot(without[g]), 2);
  }
  s.held_back_rms = std::sqrt(held_back / count);

  double effect = 0;
  for (const TargetView& target : problem.targets)
    effect += std::pow(s.sigma_at(target.p) / std::max(0.02, std::abs(s.plane.normal.dot(target.ray))), 2);
  s.effect_sigma =
      problem.targets.empty() ? s.sigma_m : std::sqrt(effect / static_cast<double>(problem.targets.size()));
  slope_over_elbow(problem, s);
  return s;
}

PlaneDifference difference(const LaserPlaneSolution& a, const LaserPlaneSolution& b) {
  PlaneDifference d;
  d.angle = std::asin(std::min(1.0, a.plane.normal.cross(b.plane.normal).norm()));
  d.distance = std::abs(b.plane.distance(a.centre));
  const double reach = std::sqrt(std::max(1e-12, a.covariance(2, 2) / std::max(a.covariance(1, 1), 1e-18)));
  for (const double v : {-reach, 0.0, reach}) {
    const Vector3d p = a.centre + v * a.axis_v;
    const double sigma = std::hypot(a.sigma_at(p), b.sigma_at(p));
    d.sigmas = std::max(d.sigmas, std::abs(b.plane.distance(p)) / std::max(sigma, 1e-9));
  }
  return d;
}

}  // namespace tankrig
