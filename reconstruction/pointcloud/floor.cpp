#include "reconstruction/pointcloud/floor.hpp"

#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <cmath>

#include "reconstruction/pointcloud/cloud_filters.hpp"
#include "reconstruction/pointcloud/pcl_conversion.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastPoints = 50;

/// The largest plane across `up`, its normal upwards.
std::optional<Plane> largest_plane(const PointCloud& cloud, const Vector3d& up, const FloorSettings& settings) {
  if (cloud.points.size() < kLeastPoints) return std::nullopt;
  const auto model =
      pcl::make_shared<pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>>(to_pcl<pcl::PointXYZ>(cloud));
  model->setAxis(up.cast<float>());
  model->setEpsAngle(settings.max_tilt);
  pcl::RandomSampleConsensus<pcl::PointXYZ> consensus(model, settings.band_m);
  consensus.setMaxIterations(500);
  if (!consensus.computeModel()) return std::nullopt;
  pcl::Indices inliers;
  Eigen::VectorXf rough, found;
  consensus.getInliers(inliers);
  consensus.getModelCoefficients(rough);
  model->optimizeModelCoefficients(inliers, rough, found);
  model->selectWithinDistance(found, settings.band_m, inliers);
  if (inliers.size() < kLeastPoints) return std::nullopt;
  const Plane plane{found.head<3>().cast<double>(), found[3]};
  const double sign = plane.normal.dot(up) < 0 ? -1 : 1, length = plane.normal.norm();
  return Plane{sign / length * plane.normal, sign / length * plane.offset};
}

Floor floor_on(const Plane& plane, const PointCloud& cloud, double band_m) {
  Floor floor{plane, {}, 0};
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const double distance = plane.distance(cloud.points[i].p);
    if (std::abs(distance) > band_m) continue;
    floor.points.push_back(static_cast<int>(i));
    floor.rms_m += distance * distance;
  }
  floor.rms_m = std::sqrt(floor.rms_m / static_cast<double>(floor.points.size()));
  return floor;
}

}  // namespace

std::optional<Vector3d> up_in(const std::string& frame) {
  if (frame == "b") return -Vector3d::UnitZ();
  if (frame == "o" || frame == "w") return Vector3d::UnitZ();
  return std::nullopt;
}

std::optional<Floor> find_floor(const PointCloud& cloud, const Vector3d& up, const FloorSettings& settings) {
  const QuietPcl quiet;
  constexpr double kMostBelow = 0.02;
  constexpr double kFlat = 0.45;  // points spread evenly over the band, as on a wall it cuts, have 0.58
  PointCloud rest = cloud;
  while (const auto plane = largest_plane(rest, up, settings)) {
    std::size_t below = 0;
    std::vector<int> on;
    for (std::size_t i = 0; i < rest.points.size(); ++i) {
      const double distance = plane->distance(rest.points[i].p);
      below += distance < -settings.band_m;
      if (std::abs(distance) <= settings.band_m) on.push_back(static_cast<int>(i));
    }
    if (static_cast<double>(below) <= kMostBelow * static_cast<double>(cloud.points.size())) {
      const Floor floor = floor_on(*plane, cloud, settings.band_m);
      if (floor.rms_m < kFlat * settings.band_m) return floor;
    }
    rest = without(rest, on);
  }
  return std::nullopt;
}

}  // namespace tankrig
