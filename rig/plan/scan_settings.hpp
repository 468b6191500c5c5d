// What a scan does and how strictly it is watched, as plain numbers: the rig file's `scan` section.
#pragma once

#include <optional>

#include "core/arm_model.hpp"
#include "core/time.hpp"
#include "rig/plan/motion_profile.hpp"
#include "rig/platform/real_time_settings.hpp"
#include "rig/safety/joint_limits.hpp"
#include "rig/safety/safety_settings.hpp"
#include "rig/sync/sync_gate.hpp"
#include "rig/sync/target_motion.hpp"

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
  double sweep_jerk = 5;       ///< so the ramp to 0.1 rad/s takes 0.3 s
  double sweep_lead_in = 0.4;  ///< time at constant velocity before the recorded part begins [s]
  int passes = 1;              ///< pass k's lines fall k / passes of a line spacing beside pass 0's
  bool there_and_back = true;  ///< odd passes sweep backwards; else the elbow returns and repeats

  // Moves between postures: straight in joint space, all joints start and stop together.
  double move_velocity = 0.1;  ///< of the fastest joint
  double move_acceleration = 0.5;
  double move_jerk = 5;
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
  RealTimeSettings real_time;
  SafetySettings safety;
  JointLimits limits;
  double feed_forward_lead =
      0.035;                   ///< planned velocity is sent this much early: the actuators' lag and the carrier's [s]
  double position_gain = 6.0;  ///< velocity correction per position error [1/s]
  double learning_rate = 2.0;  ///< relative velocity correction per second and second of trail [1/s^2]
  /// Slowest even speed of every joint: slower set-points are rounded to it or to rest [rad/s].
  JointVector dead_zone = (JointVector() << 0.06, 0.06, 0.06, 0.2, 0.1).finished();
  double following_error_limit = 0.05;  ///< planned minus measured, any joint; beyond it is a fault [rad]
  double feedback_timeout = 0.25;       ///< longest silence of the arm [s]
  double heartbeat_timeout = 0.25;      ///< longest silence of whoever supervises the cycle [s]
  double max_joint_gap = 0.1;           ///< widest pair of joint samples a frame may be interpolated between [s]
  SyncGate sync;
  std::optional<SyncTarget> target;  ///< what sync residuals are told on in millimetres

  ProfileLimits sweep_limits() const { return {sweep_velocity, sweep_acceleration, sweep_jerk}; }
  ProfileLimits move_limits() const { return {move_velocity, move_acceleration, move_jerk}; }
};

}  // namespace tankrig
