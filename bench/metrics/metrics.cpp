#include "bench/metrics/metrics.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "bench/metrics/coverage.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

Plane ground_below(const TriangleMesh& mesh) { return {Vector3d::UnitZ(), -mesh.bounds().min().z()}; }

MetricThresholds complete(MetricThresholds t, const TriangleMesh& mesh, const Ceiling* ceiling) {
  const auto expect = [](bool holds, const char* what) {
    if (!holds) throw InputError(std::string("thresholds: ") + what);
  };
  expect(t.inlier_m > 0, "inlier_m is not positive");
  expect(t.outlier_m >= t.inlier_m, "outlier_m is below inlier_m");
  expect(t.coverage_headline_m > 0, "coverage_headline_m is not positive");
  expect(t.ground_band_m >= 0, "ground_band_m is negative");
  expect(std::all_of(t.coverage_m.begin(), t.coverage_m.end(), [](double m) { return m > 0; }),
         "coverage_m has a value that is not positive");
  if (!t.ground) t.ground = ground_below(mesh);
  if (ceiling != nullptr) t.max_incidence = ceiling->max_incidence;
  t.coverage_m.push_back(t.coverage_headline_m);
  std::sort(t.coverage_m.begin(), t.coverage_m.end());
  t.coverage_m.erase(std::unique(t.coverage_m.begin(), t.coverage_m.end()), t.coverage_m.end());
  return t;
}

/// Points as near to the ground as to the mesh, up to rounding, are the object's [m].
constexpr double kTie = 1e-9;

PointVerdict judge(const Vector3d& p, double distance, const MetricThresholds& t) {
  const double above_ground = std::abs(t.ground->distance(p));
  if (above_ground <= t.ground_band_m && above_ground + kTie < distance) return PointVerdict::kGround;
  if (distance <= t.inlier_m) return PointVerdict::kObject;
  return distance > t.outlier_m ? PointVerdict::kOutlier : PointVerdict::kRejected;
}

/// Quantile `q` of ascending `sorted`, linear between ranks.
double quantile(const std::vector<double>& sorted, double q) {
  const double rank = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

ErrorFigures error_figures(std::vector<double> distances, const std::vector<double>& signed_distances, bool closed) {
  const double n = static_cast<double>(distances.size());
  ErrorFigures e;
  double sum = 0, sum_squared = 0, sum_signed = 0;
  for (double d : distances) {
    sum += d;
    sum_squared += d * d;
  }
  for (double d : signed_distances) sum_signed += d;
  e.mean = sum / n;
  e.rms = std::sqrt(sum_squared / n);
  if (closed) e.bias = sum_signed / n;
  if (distances.size() > 1) {
    double spread = 0;
    for (double d : distances) spread += (d - e.mean) * (d - e.mean);
    e.stddev = std::sqrt(spread / (n - 1));
    e.mean_sigma = *e.stddev / std::sqrt(n);
  }
  std::sort(distances.begin(), distances.end());
  e.median = quantile(distances, 0.5);
  e.p95 = quantile(distances, 0.95);
  return e;
}

std::optional<double> share(std::size_t part, std::size_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

ObjectSurface::ObjectSurface(TriangleMesh mesh, std::size_t surface_samples)
    : mesh_(std::move(mesh)), distance_(mesh_), samples_(sample_surface(mesh_, surface_samples)) {}

const Coverage& Metrics::headline() const {
  return *std::find_if(coverage.begin(), coverage.end(),
                       [&](const Coverage& c) { return c.threshold_m == thresholds.coverage_headline_m; });
}

Metrics evaluate(const PointCloud& cloud, const ObjectSurface& object, const MetricThresholds& thresholds,
                 const Ceiling* ceiling) {
  if (ceiling != nullptr && ceiling->reachable.size() != object.samples().size())
    throw InputError(fmt::format("ceiling has {} samples, expected the object's {}", ceiling->reachable.size(),
                                 object.samples().size()));
  Metrics m;
  m.thresholds = complete(thresholds, object.mesh(), ceiling);
  m.surface_area = object.mesh().area();
  m.samples = object.samples().size();
  m.points = cloud.points.size() + cloud.invalid;
  m.verdicts.assign(cloud.points.size(), PointVerdict::kRejected);
  m.distances.assign(cloud.points.size(), std::numeric_limits<double>::quiet_NaN());

  std::vector<Vector3d> finite;
  std::vector<std::size_t> origin;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].p.allFinite()) continue;
    finite.push_back(cloud.points[i].p);
    origin.push_back(i);
  }
  m.invalid_points = m.points - finite.size();

  const std::vector<SurfaceDistance> found = object.distance().at(finite);
  std::vector<double> distances, signed_distances;
  std::vector<Vector3d> on_object;
  for (std::size_t i = 0; i < finite.size(); ++i) {
    const PointVerdict verdict = judge(finite[i], found[i].distance, m.thresholds);
    m.verdicts[origin[i]] = verdict;
    m.distances[origin[i]] = found[i].distance;
    m.ground_points += verdict == PointVerdict::kGround;
    m.outlier_count += verdict == PointVerdict::kOutlier;
    if (verdict != PointVerdict::kObject) continue;
    distances.push_back(found[i].distance);
    signed_distances.push_back(found[i].signed_distance);
    on_object.push_back(finite[i]);
  }
  m.object_points = on_object.size();
  m.outliers = share(m.outlier_count, finite.size() - m.ground_points);
  m.rejected = share(m.points - m.object_points, m.points);
  if (!distances.empty()) m.error = error_figures(std::move(distances), signed_distances, object.distance().closed());
  m.coverage = surface_coverage(object.samples(), on_object, m.thresholds.coverage_m, ceiling);
  if (ceiling != nullptr) {
    m.coverage_ceiling = ceiling->share;
    m.coverage_ceiling_sigma = ceiling->sigma;
  }
  return m;
}

}  // namespace tankrig
