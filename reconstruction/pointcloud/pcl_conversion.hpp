// The one conversion between our clouds and PCL's. Included only by what calls PCL: its headers compile slowly.
#pragma once

#include <pcl/console/print.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// Every field of a CloudPoint, for programs that want our clouds in PCL with their provenance. What PCL writes of it
/// read_cloud() reads, and the other way round.
struct EIGEN_ALIGN16 PclPoint {
  PCL_ADD_POINT4D;
  PCL_ADD_NORMAL4D;
  float intensity = 0;
  std::int32_t frame = -1;
  float column = -1;
  float sigma = 0;
};

/// While it lives, PCL says nothing on the terminal: what its results say is enough.
class QuietPcl {
 public:
  QuietPcl() { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }
  ~QuietPcl() { pcl::console::setVerbosityLevel(before_); }
  QuietPcl(const QuietPcl&) = delete;
  QuietPcl& operator=(const QuietPcl&) = delete;

 private:
  pcl::console::VERBOSITY_LEVEL before_ = pcl::console::getVerbosityLevel();
};

/// The cloud as PCL's, with the fields that `Point` has; coordinates are rounded to single precision. Its frame goes
/// into header.frame_id.
template <class Point>
typename pcl::PointCloud<Point>::Ptr to_pcl(const PointCloud& cloud) {
  auto out = std::make_shared<pcl::PointCloud<Point>>();
  out->header.frame_id = cloud.frame;
  out->reserve(cloud.points.size());
  for (const CloudPoint& from : cloud.points) {
    Point to;
    to.getVector3fMap() = from.p.cast<float>();
    if constexpr (requires { to.getNormalVector3fMap(); }) to.getNormalVector3fMap() = from.normal;
    if constexpr (requires { to.intensity; }) to.intensity = from.intensity;
    if constexpr (requires { to.frame; }) to.frame = from.frame;
    if constexpr (requires { to.column; }) to.column = from.column;
    if constexpr (requires { to.sigma; }) to.sigma = from.sigma;
    out->push_back(to);
  }
  return out;
}

/// Points with a coordinate that is not finite are left out and counted; a normal that is not finite is unknown.
template <class Point>
PointCloud from_pcl(const pcl::PointCloud<Point>& cloud) {
  PointCloud out{cloud.header.frame_id, {}, 0};
  out.points.reserve(cloud.size());
  for (const Point& from : cloud) {
    CloudPoint to;
    to.p = from.getVector3fMap().template cast<double>();
    if (!to.p.allFinite()) {
      ++out.invalid;
      continue;
    }
    if constexpr (requires { from.getNormalVector3fMap(); })
      if (from.getNormalVector3fMap().allFinite()) to.normal = from.getNormalVector3fMap();
    if constexpr (requires { from.intensity; }) to.intensity = from.intensity;
    if constexpr (requires { from.frame; }) to.frame = from.frame;
    if constexpr (requires { from.column; }) to.column = from.column;
    if constexpr (requires { from.sigma; }) to.sigma = from.sigma;
    out.points.push_back(to);
  }
  return out;
}

}  // namespace tankrig

POINT_CLOUD_REGISTER_POINT_STRUCT(tankrig::PclPoint,
                                  (float, x, x)(float, y, y)(float, z, z)(float, intensity, intensity)(
                                      std::int32_t, frame, frame)(float, column, column)(float, sigma, sigma)(
                                      float, normal_x, normal_x)(float, normal_y, normal_y)(float, normal_z, normal_z))
