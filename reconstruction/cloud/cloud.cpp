#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

PointCloud transformed(const Transform& aMb, const PointCloud& cloud_b, std::string frame) {
  PointCloud cloud_a{std::move(frame), cloud_b.points, cloud_b.invalid};
  for (CloudPoint& point : cloud_a.points) point.p = aMb * point.p;
  return cloud_a;
}

}  // namespace tankrig
