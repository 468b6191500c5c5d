#include "reconstruction/pointcloud/normals.hpp"

#include <pcl/features/normal_3d.h>
#include <pcl/search/kdtree.h>

#include "reconstruction/pointcloud/pcl_conversion.hpp"

namespace tankrig {

PointCloud with_normals(const PointCloud& cloud, double radius_m, const Vector3d& seen_from) {
  PointCloud out{cloud.frame, {}, cloud.invalid};
  if (cloud.points.empty()) return out;
  const auto points = to_pcl<pcl::PointXYZ>(cloud);
  const auto tree = std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  tree->setInputCloud(points);
  const Eigen::Vector3f eye = seen_from.cast<float>();
  std::vector<int> neighbours;
  std::vector<float> squared;
  constexpr std::size_t kLeastNeighbours = 5;  // itself among them
  for (std::size_t i = 0; i < points->size(); ++i) {
    tree->radiusSearch((*points)[i], radius_m, neighbours, squared);
    Eigen::Vector4f plane;
    float curvature = 0;
    if (neighbours.size() < kLeastNeighbours || !pcl::computePointNormal(*points, neighbours, plane, curvature) ||
        !plane.head<3>().allFinite())
      continue;
    pcl::flipNormalTowardsViewpoint((*points)[i], eye.x(), eye.y(), eye.z(), plane);
    out.points.push_back(cloud.points[i]);
    out.points.back().normal = plane.head<3>().normalized();
  }
  return out;
}

}  // namespace tankrig
