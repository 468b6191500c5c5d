// The paper's figures of a cloud against the object's mesh: error, outliers, coverage.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "bench/metrics/ceiling.hpp"
#include "bench/metrics/mesh_distance.hpp"
#include "core/angles.hpp"
#include "core/config_node.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// Every number that decides what a score means; all of them are repeated in the result.
struct MetricThresholds {
  double inlier_m = 0.010;   ///< points this near to the surface are the object's: they carry the error figures
  double outlier_m = 0.010;  ///< points farther than this are outliers; >= inlier_m
  std::vector<double> coverage_m{0.002, 0.005,
                                 0.010};    ///< surface nearer than this to one of the object's points is covered
  double coverage_headline_m = 0.010;       ///< the one quoted alone
  double ground_band_m = 0.010;             ///< how far from the ground a ground point may be
  std::optional<Plane> ground;              ///< frame o; none: horizontal (z_o), through the mesh's lowest point
  double max_incidence = from_degrees(75);  ///< of the ceiling [rad]
  std::size_t surface_samples = 200'000;    ///< patches of the surface, about
};

/// The rig file's `evaluation`.
extern const SettingsTable<MetricThresholds> kMetricKeys;

/// The object prepared for scoring many clouds.
class ObjectSurface {
 public:
  explicit ObjectSurface(TriangleMesh mesh, std::size_t surface_samples = MetricThresholds{}.surface_samples);

  const TriangleMesh& mesh() const { return mesh_; }
  const MeshDistance& distance() const { return distance_; }
  const std::vector<SurfaceSample>& samples() const { return samples_; }

 private:
  TriangleMesh mesh_;
  MeshDistance distance_;
  std::vector<SurfaceSample> samples_;
};

/// What a point was taken for.
enum class PointVerdict : std::uint8_t {
  kGround,    ///< within the ground band and nearer to the ground than to the mesh; in no figure
  kObject,    ///< within inlier_m
  kOutlier,   ///< beyond outlier_m
  kRejected,  ///< between the two thresholds, or not finite
};

/// Shares are 0..1; `sigma` is the sampling error, one standard deviation.
struct Coverage {
  double threshold_m = 0;
  double whole = 0;  ///< share of the whole surface
  double whole_sigma = 0;
  std::optional<double> of_ceiling;  ///< share of the ceiling's surface; none without a ceiling or for an empty one
  std::optional<double> of_ceiling_sigma;
};

/// Distances over the object's points.
/// Units: metres.
struct ErrorFigures {
  double mean = 0;
  double median = 0;
  double rms = 0;
  double p95 = 0;                    ///< linear between ranks
  std::optional<double> stddev;      ///< of the distance, n - 1; none for one point
  std::optional<double> mean_sigma;  ///< standard error of the mean, were the points independent
  std::optional<double> bias;        ///< mean signed distance, positive outside; none for an open mesh
};

struct Metrics {
  std::size_t points = 0;  ///< with those left out when the cloud was read
  std::size_t ground_points = 0;
  std::size_t object_points = 0;
  std::size_t outlier_count = 0;
  std::size_t invalid_points = 0;     ///< not finite, in the cloud or left out when it was read
  std::optional<double> outliers;     ///< share of the points that are finite and not ground; none if there are none
  std::optional<double> rejected;     ///< share of all points that carry no error figure; none for an empty cloud
  std::optional<ErrorFigures> error;  ///< none without object points: never a perfect score
  std::vector<Coverage> coverage;     ///< ascending thresholds, the headline's among them
  std::optional<double> coverage_ceiling;  ///< share of the whole surface that could be seen
  std::optional<double> coverage_ceiling_sigma;
  double surface_area = 0;             ///< [m2]
  std::size_t samples = 0;             ///< patches coverage was counted on
  MetricThresholds thresholds;         ///< as used, `ground` filled in
  std::vector<PointVerdict> verdicts;  ///< one per point present in the cloud
  std::vector<double> distances;       ///< likewise, to the surface [m]; NaN for a point that is not finite

  const Coverage& headline() const;
};

/// Frames: `cloud` in o. `ceiling` was made from the object's samples; without one its figures are absent.
/// Errors: InputError for thresholds out of order or a ceiling of another surface.
Metrics evaluate(const PointCloud& cloud, const ObjectSurface& object, const MetricThresholds& thresholds,
                 const Ceiling* ceiling = nullptr);

}  // namespace tankrig
