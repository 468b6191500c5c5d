#include "calibration/laser_plane/sheet_ransac.hpp"

#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_plane.h>

#include <algorithm>

namespace tankrig {

std::optional<Plane> ransac_plane(const std::vector<Vector3d>& points, double inlier_distance) {
  constexpr std::size_t kMostPoints = 20000;
  constexpr int kIterations = 1000;
  if (points.size() < 3) return std::nullopt;
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& p : points) centre += p / static_cast<double>(points.size());
  const std::size_t step = (points.size() + kMostPoints - 1) / kMostPoints;
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (std::size_t i = 0; i < points.size(); i += step) {
    const Eigen::Vector3f p = (points[i] - centre).cast<float>();
    cloud->push_back({p.x(), p.y(), p.z()});
  }
  const auto model = pcl::make_shared<pcl::SampleConsensusModelPlane<pcl::PointXYZ>>(cloud, false);
  pcl::RandomSampleConsensus<pcl::PointXYZ> consensus(model, inlier_distance);
  consensus.setMaxIterations(kIterations);
  if (!consensus.computeModel()) return std::nullopt;
  Eigen::VectorXf found;
  consensus.getModelCoefficients(found);
  const Vector3d normal = found.head<3>().cast<double>();
  if (!(normal.norm() > 0)) return std::nullopt;
  const Plane plane{normal.normalized(), found[3] / normal.norm()};
  return Plane{plane.normal, plane.offset - plane.normal.dot(centre)};
}

}  // namespace tankrig
