// The whole rig at once: lenses, cameras, arm and laser that fit the boards, the marker and the stripe together, and what the steps
// before, each for itself, have left inconsistent.
//
// Every group of measurements is weighed by what it errs, and that is measured with the rest: variance components (W. Foerstner
// 1979). Errors that neighbours share make a group count for less. What moves between postures is part of the problem: joints stand
// elsewhere than they read, another way in each posture; in the sweep, slew and shoulder rest, and are off by the same all along. Pictures
// that are taken while a joint moves show it where it was a delay before: linear in the delay, by the joint's speed. Lenses that were
// calibrated in air are held (BoardBundle::lens_held).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/estimate/estimate.hpp"
#include "calibration/intrinsics/intrinsics.hpp"
#include "calibration/laser_plane/stripe_points.hpp"
#include "calibration/marker/marker.hpp"
#include "core/arm_model.hpp"

namespace tankrig {

/// The same boards with `camera` first, and everything in it.
BoardBundle seen_from(const BoardBundle& boards, std::size_t camera);

/// The marker in one posture.
struct MarkerPosture {
  std::string name;
  JointVector q = JointVector::Zero();
  std::vector<SeenMarker> seen;  ///< one per camera; empty where it did not see the marker
};

/// One picture's stripe on a flat board, as two places on it that err independently: to either side of its middle, as far as its
/// points are spread.
struct BoardStripe {
  JointVector q = JointVector::Zero(), velocity = JointVector::Zero();  ///< at the picture's stamp
  std::array<Vector2d, 2> pixels;
};

/// The straight line through a stripe's points. Nothing if they are no line of some length.
/// `points`: in c.
std::optional<BoardStripe> board_stripe(const CameraModel& camera, const Transform& cMt,
                                        const std::vector<PlacedStripePoint>& points, const JointVector& q,
                                        const JointVector& velocity);

/// A flat board that stands still under the sweep, seen by camera 0.
struct SheetBoard {
  std::string name;
  std::vector<Vector3d> points;   ///< on the board, z = 0
  std::vector<Vector2d> corners;  ///< where camera 0 sees them, all of them
  Transform cMt = Transform::Identity();
  std::vector<BoardStripe> stripes;  ///< one after another in time
};

/// Camera 0's delay, t_camera - t_joints, as a sweep there and back over any surface tells it: that says nothing else of the rig, and
/// nothing else of the rig says that (time_offset.hpp).
struct SweepDelay {
  double value = 0;       ///< beyond what stamps were corrected by [s]
  double half_width = 0;  ///< of its 95 % interval [s]
};

/// Frames: c is camera 0, that which sees the stripe.
/// The steps' results are where it starts.
struct JointProblem {
  BoardBundle boards;
  std::vector<std::string> cameras;  ///< their names
  Transform cMb = Transform::Identity(), eMg = Transform::Identity();
  ArmModel arm;                         ///< with its zeros
  std::array<bool, 4> refined_zeros{};  ///< of slew, shoulder, elbow, jaw rotation
  std::vector<MarkerPosture> postures;
  std::vector<SheetBoard> sheets;
  Plane ePl;
  std::optional<SweepDelay> delay;  ///< nothing: stripes of both directions tell it
};

/// What a group of measurements errs.
struct ErrorGroup {
  std::string name, unit;
  std::size_t measurements = 0;  ///< numbers
  double sigma = 0;              ///< of one
  double allowance = 1;          ///< factor on it, because neighbours err alike
};

/// Something that was taken to stand still, and the move that would explain the measurements better.
struct Discrepancy {
  std::string name;
  double sigmas = 0;  ///< root of what the sum of squares would fall by: Mahalanobis' distance, of six freedoms
  struct Size {
    double moved = 0, turned = 0;  ///< [m, rad]
  };
  std::optional<Size> size;  ///< nothing where the measurements do not tell all six
};
/// Six freedoms by chance: one in fifty thousand is beyond.
inline constexpr double kMostSigmas = 5.8;

/// Frames: c is camera 0.
struct JointSolution {
  BoardBundle boards;
  Transform cMb = Transform::Identity(), eMg = Transform::Identity();
  ArmModel arm;
  Plane ePl;                        ///< for joints as they read in the sweep, the delay taken off
  Vector3d centre, axis_u, axis_v;  ///< of the stripes, in e, and in the plane: what its numbers are about
  std::vector<Estimate>
      parameters;  ///< lenses, ports, kMc, cMb, eMg, zeros, the laser's tilts and distance from where the steps have it, the
                   ///< delay beyond what stamps were corrected by; effects: the worse of laser and stereo
  Eigen::MatrixXd covariance;  ///< of `parameters`
  std::vector<Transform> bMk;  ///< of every camera
  std::vector<Eigen::Matrix<double, 6, 6>>
      mount_covariance;                   ///< of a step of bMk: a rotation about the axes of b, then a translation
  Transform lMr = Transform::Identity();  ///< the last camera in camera 1, where there are three
  Eigen::Matrix<double, 6, 6> pair_covariance, gripper_covariance;  ///< of steps of lMr and eMg
  double sigma_rad = 0, sigma_m = 0;  ///< of the laser: the worse tilt, the distance at the centre
  double rms = 0;                     ///< of the stripes' places from the laser's plane [m]
  double laser_sigma = 0;             ///< of places on the stripes, along the rays, by everything together [m]
  double stereo_sigma = 0;            ///< likewise by cameras 1 and 2; 0: they do not see them
  std::vector<ErrorGroup> groups;
  std::vector<Discrepancy> discrepancies;  ///< the worst first
  std::size_t stripes = 0, strays = 0;     ///< strays: far from the plane, left out

  /// Of the parameter of this name; nothing if it was held.
  const Estimate* parameter(const std::string& name) const;
};

/// Threads: one. The same problem gives the same bits.
/// Errors: InputError with what is missing: no boards, fewer than six postures, fewer than two boards under the stripe; or with a
/// number that the data leaves open.
JointSolution solve(const JointProblem& problem);

}  // namespace tankrig
