// The time offset between a camera's stamps and the joints', from a sweep there and back: the two clouds must coincide.
//
//   t_camera = t_joints + offset
//
// A frame stamped t shows the arm as the joint samples have it at t - offset. Positive: the camera's stamps are late.
//
// The camera stands still, so the two clouds coincide exactly if every ray meets the surface at the same range on the
// way there and on the way back. The stripe passes each pixel once in either sweep; between two frames of one sweep the
// inverse depth along an image column is linear (it is on a plane). A wrong laser plane or camera pose moves both
// clouds alike and does not matter to first order: only time, and backlash between encoder and link, tell the directions
// apart.
//
// Play acts as the encoders leading the link by half of it: at one speed it reads as an offset of
// backlash / (2 * speed). Recordings at different speeds tell the two apart; with one speed the backlash is taken as zero, and
// `offset_per_backlash` says what that is worth.
#pragma once

#include <optional>
#include <vector>

#include "calibration/time_offset/joint_motion.hpp"
#include "core/arm_model.hpp"
#include "core/camera_model.hpp"
#include "core/time.hpp"

namespace tankrig {

/// A point of the stripe.
/// Units: pixels.
struct TimedStripePoint {
  int line = 0;         ///< the image column it was searched in; the row, for a stripe across the rows
  double position = 0;  ///< along that line, sub-pixel
  double sigma = 0.1;   ///< of `position`
};

struct TimedStripe {
  Stamp stamp{};  ///< mid-exposure by the camera's stamps
  int pass = 0;   ///< of the sweep
  std::vector<TimedStripePoint> points;
};

/// One recording: the camera and the object stood still in it.
struct TimeOffsetRecording {
  std::vector<TimedJoints> joints;   ///< in order of time
  std::vector<TimedStripe> stripes;  ///< in order of time
};

struct TimeOffsetProblem {
  CameraModel camera;
  bool rows = false;                      ///< stripe points are searched along image rows, not columns
  Transform cMb = Transform::Identity();  ///< arm base in the camera
  ArmModel arm;
  Plane ePl;  ///< laser plane rigid with the end effector
  std::vector<TimeOffsetRecording> recordings;
};

/// How far apart the two clouds are, along the viewing rays [m].
struct CloudDistance {
  double mean = 0;    ///< signed: backward minus forward
  double median = 0;  ///< of the absolute values
  double rms = 0;     ///< without the worst 5 %
};

/// Units: seconds, metres, radians.
struct TimeOffsetSolution {
  double offset = 0;
  double sigma = 0;       ///< one standard deviation, from how the residuals vary along the sweep
  double half_width = 0;  ///< of the 95 % interval about `offset`: Student's t with the sigma's degrees of freedom
  std::optional<double> backlash;  ///< of the swept joint, total; only from recordings of different speed
  double backlash_sigma = 0;
  double offset_per_backlash = 0;  ///< what a backlash that is taken as zero would add to `offset` [s/rad]
  double speed_on_target = 0;      ///< how fast the measured point moves along its ray, median [m/s]
  double effect = 0;               ///< |offset| on the target: speed_on_target * |offset| [m]
  double effect_sigma = 0;         ///< likewise of `sigma`
  CloudDistance before, after;     ///< at offset 0 and backlash 0, and at the solution
  std::vector<double> residuals;   ///< at the solution, of every pair [m]
  std::size_t pairs = 0;           ///< places on the target seen in both directions
  std::size_t stripes = 0;         ///< frames that have a part in them
  std::vector<double> speeds;      ///< mean |velocity| of the swept joint, per recording [rad/s]
};

/// Threads: any.
/// Errors: InputError with what was found and what to record instead: no two passes in opposite directions, too few
/// places seen in both, joints that do not cover the stripes.
TimeOffsetSolution solve(const TimeOffsetProblem& problem);

}  // namespace tankrig
