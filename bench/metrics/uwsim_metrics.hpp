// The reference module's own arithmetic (UWSim benchmarks, Reconstruction3D), kept for comparison with published
// figures.
//
// Its oddities, reproduced on purpose:
//  * the object is its axis-aligned box, not its mesh (the object must stand upright; here the axes are the object's);
//  * a point is ground if nearer to the plane through the box's bottom than to the box, and within 0.10 m of it;
//  * everything nearer than 0.15 m enters the mean, so errors of 15 cm do;
//  * the spread is a variance [m2]: undefined for one point, -0 for none;
//  * coverage counts nodes of a lattice; every point, ground and outliers too, marks the (up to 8) nodes around it;
//  * marked nodes are counted on the top and four sides, but divided by 2XY + XZ + 2YZ - 2X - 4Y - 2Z + 4, which leaves
//  out
//    one x-z side and has both x-y faces: a perfect cloud may read less or more than 100 %;
//  * the number of nodes depends on rounding: 0.30 m / 0.01 m makes 30 nodes, not 31. Box corners are rounded to 1 um
//  here so
//    that a mesh stored in single precision counts like its nominal size (in single precision the reference itself
//    would make 15 x 31 x 16 nodes of a 140 x 300 x 160 mm box instead of 15 x 30 x 17);
//  * an empty cloud has mean error 0 and no outliers: a perfect score.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bench/metrics/triangle_mesh.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

struct UwsimMetrics {
  std::size_t points = 0;
  std::size_t ground_points = 0;
  std::size_t inliers = 0;
  std::size_t outlier_count = 0;
  double mean_error_m = 0;
  double error_variance_m2 = 0;  ///< NaN for one inlier
  double coverage = 0;           ///< marked nodes / denominator; may pass 1
  double outliers = 0;           ///< share of inliers and outliers, 0 if there are none
  double level_of_detail_m = 0;
  std::array<int, 3> lattice{};  ///< nodes along x, y, z
  int marked_nodes = 0;
  int denominator = 0;
};

inline constexpr double kUwsimOutlier = 0.15;     ///< [m]
inline constexpr double kUwsimGroundBand = 0.10;  ///< [m]

/// One sentence per oddity, for the result file.
const std::vector<std::string>& uwsim_oddities();

/// Frames: `cloud` in o. Points with a coordinate that is not finite are skipped.
/// Errors: InputError if an edge of the box is shorter than `level_of_detail_m`.
UwsimMetrics uwsim_metrics(const PointCloud& cloud, const TriangleMesh& mesh, double level_of_detail_m = 0.01);

}  // namespace tankrig
