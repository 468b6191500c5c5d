// A reconstructed point cloud with the provenance of every point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Frames: the cloud's (`PointCloud::frame`).
/// Units: metres.
struct CloudPoint {
  Vector3d p = Vector3d::Zero();
  float intensity = 0;      ///< [0, 1] of full scale
  std::int32_t frame = -1;  ///< index of the frame in its camera's sequence, -1 unknown
  float column = -1;        ///< image column (or row, for a stripe along columns) [px], -1 unknown
  float sigma = 0;          ///< one standard deviation along the viewing ray [m], 0 unknown
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, out of the surface; 0 unknown

  bool has_normal() const { return !normal.isZero(0); }
};

struct PointCloud {
  std::string frame = "c";  ///< letter of core/frames.hpp
  std::vector<CloudPoint> points;
  std::size_t invalid = 0;  ///< points of the file left out because a coordinate was not finite

  bool has_normals() const;  ///< of every point, and there are points
};

/// The cloud, given in b, expressed in a; `frame` is a's letter.
PointCloud transformed(const Transform& aMb, const PointCloud& cloud_b, std::string frame);

}  // namespace tankrig
