// What a scan does and how strictly it is watched: the rig file's `scan` section as plain numbers.
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

/// In which phases a camera's frames are kept; never those of a move.
enum class RecordWhen : std::uint8_t { kAll, kDark, kSweep };
template <>
inline constexpr std::array kNames<RecordWhen>{"all", "dark", "sweep"};

/// The recorded sweep: constant elbow velocity between two angles; ramps and lead-in lie outside.
/// Units: SI, radians.
struct SweepSettings {
  double from = 1.3;
  double to = 2.1;
  double velocity = 0.1;  ///< > 0; the arm's dead zone ends at 0.06
  double acceleration = 0.5;
  double jerk = 5;             ///< so the ramp to 0.1 rad/s takes 0.3 s
  double lead_in = 0.4;        ///< time at constant velocity before the recorded part begins [s]
  int passes = 1;              ///< pass k's lines fall k / passes of a line spacing beside pass 0's
  bool there_and_back = true;  ///< odd passes sweep backwards; else the elbow returns and repeats

  ProfileLimits limits() const { return {velocity, acceleration, jerk}; }
};

/// Moves between postures: straight in joint space, all joints start and stop together.
/// Units: SI, radians.
struct MoveSettings {
  double velocity = 0.1;  ///< of the fastest joint
  double acceleration = 0.5;
  double jerk = 5;
  double settle = 0.5;  ///< rest before a dark block and before a sweep [s]

  ProfileLimits limits() const { return {velocity, acceleration, jerk}; }
};

/// Frames and light.
/// Units: seconds.
struct CaptureSettings {
  int dark_frames = 10;                   ///< per camera, before and after the sweep, laser off, arm at rest
  double frame_period = 0.04;             ///< of the camera that records the sweep
  double camera_lead = 0.1;               ///< a camera runs this long before its phase
  double laser_warm_up = 1.0;             ///< Laser::warm_up()
  bool laser_pairs = false;               ///< laser on in every second frame of the sweep only
  bool laser_switches_per_frame = false;  ///< the rig file says that its laser can do so
  bool read_lux = true;                   ///< ask the lux meter before and after the sweep
  double lux_accuracy = 0;                ///< the meter's limit of error, as a share of the reading; 0: not known
};

/// How the joints follow the plan.
/// Units: SI, radians.
struct ControlSettings {
  double feed_forward_lead = 0.035;  ///< planned velocity is sent this much early: the actuators' lag and the carrier's
  double position_gain = 6.0;        ///< velocity correction per position error [1/s]
  double learning_rate = 2.0;        ///< relative velocity correction per second and second of trail [1/s^2]
  /// Slowest even speed of every joint; slower set-points become it or rest [rad/s].
  JointVector dead_zone = (JointVector() << 0.06, 0.06, 0.06, 0.2, 0.1).finished();
  double following_error_limit = 0.05;  ///< planned minus measured, any joint; more is a fault [rad]
  double feedback_timeout = 0.25;       ///< longest silence of the arm [s]
  double heartbeat_timeout = 0.25;      ///< longest silence of the cycle's supervisor [s]
  double max_joint_gap = 0.1;           ///< widest pair of joint samples a frame may be interpolated between [s]
};

/// Units: SI, radians.
struct ScanSettings {
  // The sweep moves the elbow only; the other joints stay as in `posture`, whose elbow is ignored.
  JointVector park = JointVector::Zero();
  JointVector posture = JointVector::Zero();
  SweepSettings sweep;
  MoveSettings move;
  CaptureSettings capture;
  double cycle_hz = 200;
  ControlSettings control;
  RealTimeSettings real_time;
  SafetySettings safety;
  JointLimits limits;
  SyncGate sync;
  std::optional<SyncTarget> target;  ///< where sync residuals are measured in millimetres
};

}  // namespace tankrig
