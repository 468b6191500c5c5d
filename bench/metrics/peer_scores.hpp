// Scores as two well-known benchmarks define them, so that figures compare: Tanks and Temples, and ETH3D's multi-view
// evaluation. Neither aligns here: score a registered cloud for that.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "bench/metrics/metrics.hpp"

namespace tankrig {

/// A. Knapitsch and others 2017. Both clouds are thinned to voxels of tau / 2, a voxel's points to their mean; nearer
/// than tau counts.
struct TanksAndTemplesScore {
  double tau_m = 0;
  std::optional<double> precision;           ///< share of the cloud near the truth; none for an empty cloud
  double recall = 0;                         ///< share of the truth near the cloud
  double f = 0;                              ///< harmonic mean; 0 for an empty cloud
  std::size_t points = 0, truth_points = 0;  ///< after thinning
};

/// T. Schoeps and others 2017. Shares are means over voxels of 10 mm, in two grids half a voxel apart; up to the
/// tolerance counts.
struct Eth3dScore {
  double tolerance_m = 0;
  std::optional<double> accuracy;  ///< of points that the scans say something about; none where there are none
  double completeness = 0;
  double f1 = 0;
  std::size_t accurate = 0, inaccurate = 0, unobserved = 0;  ///< points
};

/// `truth`: points of the surface. Points of `cloud` that are not finite are left out.
TanksAndTemplesScore tanks_and_temples_score(const std::vector<Vector3d>& cloud, const std::vector<Vector3d>& truth,
                                             double tau_m);

/// What a laser scanner at `from` has measured.
struct TruthScan {
  Vector3d from = Vector3d::Zero();
  std::vector<Vector3d> points;
};

/// A point is accurate if a scan point, in whose beam it lies, is within the tolerance; else inaccurate if it lies before
/// such a scan point, where the scanner saw water; else unobserved. Accurate in one scan is accurate. Beams are cones
/// from 2.25 mm wide, 0.011 degrees half an opening angle.
Eth3dScore eth3d_score(const std::vector<Vector3d>& cloud, const std::vector<TruthScan>& scans, double tolerance_m);

/// The object's samples that a scanner at `from` sees from outside.
TruthScan scan_of(const ObjectSurface& object, const Vector3d& from);

/// The cloud's finite points that are not ground: what Tanks and Temples' crop leaves of it.
std::vector<Vector3d> above_ground(const PointCloud& cloud, const Metrics& metrics);

}  // namespace tankrig
