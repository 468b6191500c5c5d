#include "reconstruction/cloud/cloud.hpp"

#include <algorithm>

namespace tankrig {

bool PointCloud::has_normals() const { return !points.empty() && std::ranges::all_of(points, &CloudPoint::has_normal); }

PointCloud transformed(const Transform& aMb, const PointCloud& cloud_b, std::string frame) {
  PointCloud cloud_a{std::move(frame), cloud_b.points, cloud_b.invalid};
  const Eigen::Matrix3f rotation = aMb.linear().cast<float>();
  for (CloudPoint& point : cloud_a.points) {
    point.p = aMb * point.p;
    point.normal = rotation * point.normal;
  }
  return cloud_a;
}

}  // namespace tankrig
