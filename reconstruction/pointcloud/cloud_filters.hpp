// What takes points out of a cloud: a box, a grid, loneliness. By PCL; what stays keeps its provenance.
#pragma once

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// The points at `indices`, in their order.
PointCloud selected(const PointCloud& cloud, const std::vector<int>& indices);
/// All others.
PointCloud without(const PointCloud& cloud, const std::vector<int>& indices);

/// The points inside of `box` (faces included), or those outside.
/// Frames: both in the cloud's.
PointCloud cropped(const PointCloud& cloud, const Eigen::AlignedBox3d& box, bool keep_outside = false);

/// One point for each cube of `edge_m` that holds any: their mean, with mean intensity. It is of no one frame, column,
/// sigma or normal: these are unknown.
/// Errors: InputError if the cloud needs more than 2^31 cubes.
PointCloud voxel_grid(const PointCloud& cloud, double edge_m);

/// One of the cloud's own points for each cube of `edge_m` that holds any: the one nearest to its centre.
PointCloud thinned(const PointCloud& cloud, double edge_m);

struct OutlierFilter {
  int neighbours = 20;
  double sigmas = 2;  ///< how far above the cloud's mean a point's mean distance to its neighbours may be
};

/// Without lonely points. Source: R. B. Rusu, Z. C. Marton, N. Blodow, M. Dolha, M. Beetz, Towards 3D point cloud based
/// object maps for household environments, 2008.
PointCloud without_outliers(const PointCloud& cloud, const OutlierFilter& filter = {});

}  // namespace tankrig
