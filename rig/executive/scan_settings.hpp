// What a scan does and how strictly it is watched, as plain numbers: the rig file's `scan` section.
#pragma once

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig {

/// In which phases a camera's frames are kept. Frames of a move are never kept.
enum class RecordWhen : std::uint8_t { kAll, kDark, kSweep };

/// Units: SI, radians.
struct ScanSettings {
  // Postures. The sweep moves the elbow only; the other joints stay as in `posture`, whose elbow is ignored.
  JointVector park = JointVector::Zero();
  JointVector posture = JointVector::Zero();

  // The sweep: constant elbow velocity from `sweep_from` to `sweep_to`, ramps and lead-in outside of it.
  double sweep_from = 1.3;
  double sweep_to = 2.1;
  double sweep_velocity = 0.1;  ///< > 0; the arm's dead zone ends at 0.06
  double sweep_acceleration = 0.5;
  double sweep_lead_in = 0.25;  ///< time at constant velocity before the recorded part begins [s]
  int passes = 1;               ///< pass k's lines fall k / passes of a line spacing beside pass 0's
  bool there_and_back = true;   ///< odd passes sweep backwards; else the elbow returns and repeats

  // Moves between postures: straight in joint space, all joints start and stop together.
  double move_velocity = 0.1;  ///< of the fastest joint
  double move_acceleration = 0.5;
  double settle = 0.5;  ///< rest before a dark block and before a sweep [s]

  // Frames and laser.
  int dark_frames = 10;                   ///< per camera, before and after the sweep, laser off, arm at rest
  double frame_period = 0.04;             ///< of the camera that records the sweep [s]
  double camera_lead = 0.1;               ///< a camera runs this long before its phase [s]
  double laser_warm_up = 1.0;             ///< Laser::warm_up() [s]
  bool laser_pairs = false;               ///< laser on in every second frame of the sweep only
  bool laser_switches_per_frame = false;  ///< the rig declares that its laser can do so

  // The cycle.
  double cycle_hz = 200;
  double feed_forward_lead =
      0.035;                   ///< planned velocity is sent this much early: the actuators' lag and the carrier's [s]
  double position_gain = 6.0;  ///< velocity correction per position error [1/s]
  /// Slowest even speed of every joint: slower set-points are rounded to it or to rest [rad/s].
  JointVector dead_zone = (JointVector() << 0.06, 0.06, 0.06, 0.2, 0.1).finished();
  double following_error_limit = 0.05;  ///< planned minus measured, any joint; beyond it is a fault [rad]
  double feedback_timeout = 0.25;       ///< longest silence of the arm [s]
  double heartbeat_timeout = 0.25;      ///< longest silence of whoever supervises the cycle [s]
  double laser_off_allowance = 0.1;     ///< longest the laser may stay powered or lit when it is not commanded [s]
  double laser_on_margin = 0.25;        ///< longest it may stay dark beyond its warm-up when it is commanded [s]
  double rest_velocity = 0.01;          ///< measured joint velocity below which a joint is at rest [rad/s]
  double rest_timeout = 3.0;            ///< after the end, longest wait for laser dark and arm at rest [s]
  double max_joint_gap = 0.1;           ///< widest pair of joint samples a frame may be interpolated between [s]
};

}  // namespace tankrig
