// The laser's sheet as a plane, from points of the stripe whose places in space are known otherwise.
//
// Points come from a board (a ray through the stripe meets the board's plane) or from a stereo pair. They are given in the
// frame that carries the laser: e on an arm, c where laser and camera are one body. A line of points on one flat board tells
// two of the plane's three freedoms: several boards or postures are needed.
//
// Points of one picture err alike (pose of the board, joints), so the covariance takes a picture as one witness.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

struct SheetPoint {
  Vector3d p = Vector3d::Zero();
  double sigma = 1e-4;  ///< across the sheet [m]
  int group = 0;        ///< index into LaserPlaneProblem::groups
};

/// A picture, or all pictures of one posture.
struct SheetGroup {
  std::string name;
  std::optional<double> elbow;  ///< joint angle, on an arm [rad]
};

/// A place on the target, and the camera's unit ray to it.
struct TargetView {
  Vector3d p = Vector3d::Zero(), ray = Vector3d::UnitZ();
};

/// Frames: all of one, the laser's carrier.
struct LaserPlaneProblem {
  std::vector<SheetPoint> points;
  std::vector<SheetGroup> groups;
  double inlier_distance = 0.004;   ///< of RANSAC [m]
  std::vector<TargetView> targets;  ///< where the effect is computed; empty: at the points' centre, square to the sheet
};

struct SheetGroupFit {
  std::size_t points = 0, inliers = 0;
  double mean = 0, rms = 0;  ///< of the inliers' distances [m]
};

/// Units: metres, radians.
struct LaserPlaneSolution {
  Plane plane;                 ///< its normal on the side of the largest component
  Vector3d centre;             ///< of the inliers, on the plane
  Vector3d axis_u, axis_v;     ///< in the plane; v along the points' longest extent
  Eigen::Matrix3d covariance;  ///< of the tilts d(normal) along u and v, and of the distance at the centre
  double sigma_rad = 0;        ///< of the worse tilt
  double sigma_m = 0;          ///< of the distance at the centre
  double effect_sigma = 0;     ///< on the targets, along the rays: root mean square
  double rms = 0;              ///< of the inliers
  double held_back_rms = 0;    ///< of every group's inliers to the plane of the other groups
  double inlier_share = 0;
  std::vector<double> residuals;  ///< of every point
  std::vector<bool> inlier;
  std::vector<SheetGroupFit> groups;
  std::optional<double> slope;  ///< of the groups' means over the elbow's angle [m/rad]: 0 if kinematics are right
  double slope_sigma = 0;

  /// One standard deviation of the plane at p, across it.
  double sigma_at(const Vector3d& p) const;
};

/// Threads: any. The same problem gives the same bits.
/// Errors: InputError with what was found and what to record instead: no points, fewer than three groups, no plane, points
/// on one line.
LaserPlaneSolution solve(const LaserPlaneProblem& problem);

/// Two planes of one sheet, compared where both were measured.
struct PlaneDifference {
  double angle = 0, distance = 0;  ///< between the normals; at a's centre
  double sigmas = 0;               ///< distance over its standard deviation from both, the worst at a's points' corners
};
PlaneDifference difference(const LaserPlaneSolution& a, const LaserPlaneSolution& b);

}  // namespace tankrig
