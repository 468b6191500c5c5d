#include "rig/config/scan_section.hpp"

#include <cmath>
#include <cstdio>

#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kAngle{-7, 7}, kVelocity{0.001, 2}, kAcceleration{0.001, 20}, kJerk{0.01, 1000}, kTime{0, 600},
    kTimeout{0.001, 60}, kMilli{0, 1e6};
constexpr int kMostCpus = 1024;

void read_cpu(const ConfigNode& node, const char* key, RealTimeSettings& s) {
  const std::string text = node.text(key);
  s.cpu.reset();
  if (text == "none") return;
  int cpu = -1;
  if (!parse_number(text, cpu) || cpu < 0 || cpu >= kMostCpus)
    node.fail(key, "found '" + shown_text(text) + "', expected none or the number of a processor, from 0");
  s.cpu = cpu;
}
void write_cpu(YAML::Emitter& out, const RealTimeSettings& s) { out << (s.cpu ? std::to_string(*s.cpu) : "none"); }

std::string real(double value) { return exact_text(value); }
std::string rounded(double value) {
  char buffer[32];
  return {buffer, static_cast<std::size_t>(std::snprintf(buffer, sizeof buffer, "%.4g", value))};
}

const Setting<CaptureSettings> kCaptureRows[] = {
    {"dark_frames", &CaptureSettings::dark_frames, ConfigRange(0, 10000),
     "frames of each camera before and after the sweep, laser off, arm at rest"},
    {"camera_lead_s", &CaptureSettings::camera_lead, kTime, "a camera runs this long before its phase"},
    {"laser_pairs", &CaptureSettings::laser_pairs,
     "laser on in every second frame of the sweep only; needs `laser: switches_per_frame`"},
    {"read_lux", &CaptureSettings::read_lux, "ask the lux meter before and after the sweep"},
    {"lux_accuracy", &CaptureSettings::lux_accuracy, ConfigRange(0, 1),
     "the meter's limit of error, a share of the reading; 0: not known", Need::kSparse},
};
constexpr SettingsTable<CaptureSettings> kCapture{kCaptureRows};

const Setting<SweepSettings> kSweepRows[] = {
    {"from_rad", &SweepSettings::from, kAngle, "elbow where the recorded sweep begins", Need::kRequired},
    {"to_rad", &SweepSettings::to, kAngle, "elbow where it ends", Need::kRequired},
    {"velocity_rad_s", &SweepSettings::velocity, kVelocity,
     "of the elbow; at least its dead zone; the sweep lasts at least two frame periods", Need::kRequired},
    {"acceleration_rad_s2", &SweepSettings::acceleration, kAcceleration, "of the ramps"},
    {"jerk_rad_s3", &SweepSettings::jerk, kJerk, "of the ramps"},
    {"lead_in_s", &SweepSettings::lead_in, kTime,
     "constant velocity before the first recorded frame: backlash is taken up"},
    {"passes", &SweepSettings::passes, ConfigRange(1, 100),
     "sweeps; pass k lies k / passes of a line spacing beside pass 0"},
    {"there_and_back", &SweepSettings::there_and_back, "odd passes sweep backwards; false: the elbow returns first"},
};
constexpr SettingsTable<SweepSettings> kSweep{kSweepRows};

const Setting<MoveSettings> kMoveRows[] = {
    {"velocity_rad_s", &MoveSettings::velocity, kVelocity, "of the fastest joint, between postures"},
    {"acceleration_rad_s2", &MoveSettings::acceleration, kAcceleration, "of the ramps"},
    {"jerk_rad_s3", &MoveSettings::jerk, kJerk, "of the ramps"},
    {"settle_s", &MoveSettings::settle, kTime, "rest before a dark block and before a sweep"},
};
constexpr SettingsTable<MoveSettings> kMove{kMoveRows};

const Setting<ControlSettings> kControlRows[] = {
    {"position_gain_per_s", &ControlSettings::position_gain, ConfigRange(0, 100),
     "velocity correction per position error"},
    {"learning_rate_per_s2", &ControlSettings::learning_rate, ConfigRange(0, 100),
     "relative velocity correction per second and second of trail"},
    {"feed_forward_lead_s", &ControlSettings::feed_forward_lead, ConfigRange(0, 1),
     "planned velocities are sent this much early: lag of actuators and carrier"},
    {"dead_zone_rad_s", &ControlSettings::dead_zone, ConfigRange(0, 2),
     "slowest even speed of each joint; slower set-points become it or rest"},
    {"following_error_limit_rad", &ControlSettings::following_error_limit, ConfigRange(0.0001, 1),
     "planned minus measured, any joint; more is a fault"},
    {"feedback_timeout_s", &ControlSettings::feedback_timeout, kTimeout, "longest silence of the arm"},
    {"heartbeat_timeout_s", &ControlSettings::heartbeat_timeout, kTimeout,
     "longest silence of whoever supervises the cycle"},
    {"max_joint_gap_s", &ControlSettings::max_joint_gap, kTimeout,
     "widest pair of joint samples that a frame is interpolated between"},
};
constexpr SettingsTable<ControlSettings> kControl{kControlRows};

const Setting<OverCurrentLimit> kCurrentRows[] = {
    {"current_a", &OverCurrentLimit::amperes, ConfigRange(0.1, 50), "supply current of the whole arm"},
    {"current_s", &OverCurrentLimit::duration, ConfigRange(0, 60), "so long above it is a fault"},
};
constexpr SettingsTable<OverCurrentLimit> kCurrent{kCurrentRows};

const Setting<JointLimits> kLimitsRows[] = {
    {"beyond_rad", &JointLimits::beyond, ConfigRange(0, 0.2),
     "how far beyond its limit a joint may stand: backlash, a soft stop"},
    {"refusal_margin_rad", &JointLimits::refusal_margin, ConfigRange(0, 1),
     "nearer to a limit, a set-point towards it is refused unless the plan goes there"},
    {"velocity_rad_s", &JointLimits::velocity, ConfigRange(0.01, 10), "measured, any joint"},
    {"ticks_per_s", &JointLimits::ticks_per_s, ConfigRange(1, 1e6), "measured, any actuator"},
    {"velocity_window_ms", &JointLimits::velocity_window, ConfigRange(10, 1000), "both are measured over so long"},
    {"set_point_step_rad_s", &JointLimits::set_point_step, ConfigRange(0, 10),
     "largest change from one velocity set-point to the next; 0: any"},
    {"", &JointLimits::current, kCurrent},
};
constexpr SettingsTable<JointLimits> kLimits{kLimitsRows};

const Setting<RealTimeSettings> kOverrunsRows[] = {
    {"limit", &RealTimeSettings::overruns, ConfigRange(0, 10'000),
     "so many late cycles within the window stop the scan; 0: they are only counted"},
    {"window_s", &RealTimeSettings::window, ConfigRange(0.001, 600), "the window"},
};
constexpr SettingsTable<RealTimeSettings> kOverruns{kOverrunsRows};

const Setting<RealTimeSettings> kRealTimeRows[] = {
    {"required", &RealTimeSettings::required, "false: a scan goes on without what the system does not grant"},
    {"priority", &RealTimeSettings::priority, ConfigRange(1, 98), "of SCHED_FIFO"},
    {"cpu", {read_cpu, write_cpu, "none, or a processor's number"}, "the only processor the cycle runs on"},
    {"lock_memory", &RealTimeSettings::lock_memory, "the process's memory stays where it is"},
    {"pace", &RealTimeSettings::pace, "device: the cycle keeps step with an arm that samples by its own clock"},
    {"overruns", kOverruns},
};
constexpr SettingsTable<RealTimeSettings> kRealTime{kRealTimeRows};

const Setting<BeamSettings> kBeamRows[] = {
    {"verify", &BeamSettings::verify, "compares what cameras see with what the laser's device says"},
    {"frames", &BeamSettings::frames, ConfigRange(2, 100),
     "so many of one camera in a row against the laser's word are a fault"},
    {"dark_frames", &BeamSettings::dark_frames, ConfigRange(1, 100),
     "of a camera, before the first light; at most the scan's own"},
    {"waived", &BeamSettings::waived, "names of cameras that do not testify"},
};
constexpr SettingsTable<BeamSettings> kBeam{kBeamRows};

const Setting<SafetySettings> kSafetyRows[] = {
    {"indicator_delay_s", &SafetySettings::indicator_delay, ConfigRange(1, 60),
     "from arming to the first light, at least"},
    {"maximum_on_s", &SafetySettings::maximum_on, ConfigRange(1, 3600),
     "longest stretch of light, until it is dark for indicator_delay_s"},
    {"hold_limit_s", &SafetySettings::hold_limit, ConfigRange(1, 3600),
     "longest light with the arm at rest; at most maximum_on_s"},
    {"laser_off_allowance_s", &SafetySettings::laser_off_allowance, ConfigRange(0.01, 5),
     "longest the laser may stay powered or lit when it is not commanded"},
    {"laser_on_margin_s", &SafetySettings::laser_on_margin, ConfigRange(0.01, 5),
     "longest it may stay dark beyond its warm-up when it is commanded"},
    {"rest_velocity_rad_s", &SafetySettings::rest_velocity, ConfigRange(0.001, 0.1),
     "a joint slower than this is at rest"},
    {"rest_timeout_s", &SafetySettings::rest_timeout, ConfigRange(0.2, 60),
     "after the end, longest wait for laser dark and arm at rest"},
    {"camera_timeout_s", &SafetySettings::camera_timeout, ConfigRange(0.1, 60),
     "longest silence of a camera that has begun to deliver"},
    {"guardian_timeout_s", &SafetySettings::guardian_timeout, ConfigRange(0.02, 5),
     "longest time between two safety steps before the guardian acts; at least three cycles"},
    {"beam", &SafetySettings::beam, kBeam},
    {"heartbeat_output", &SafetySettings::heartbeat_output, kHeartbeatOutputKeys},
    {"enable_input", &SafetySettings::enable_input, kEnableInputKeys},
    {"start_warning_s", &SafetySettings::start_warning, ConfigRange(0, 60),
     "from the operator's yes to the first motion or light; left out: 3 with devices, 0 simulated"},
    {"warning_output", &SafetySettings::warning_output, kWarningOutputKeys},
    {"commissioned_within_h", &SafetySettings::commissioned_within_h, ConfigRange(1, 168),
     "longest age of the start-up test ([safety.md](safety.md)); left out: 24 with devices, none simulated"},
};
void check_hold_limit(const ConfigNode& node, const SafetySettings& s) {
  if (s.hold_limit > s.maximum_on)
    node.fail(
        node.has("hold_limit_s") ? "hold_limit_s" : "maximum_on_s",
        "found a hold_limit_s of " + real(s.hold_limit) + ", expected at most maximum_on_s, " + real(s.maximum_on));
}
constexpr SettingsTable<SafetySettings> kSafety{kSafetyRows, check_hold_limit};

const Setting<SyncGate> kSyncRows[] = {
    {"max_residual_ms", &SyncGate::max_residual, kMilli,
     "a frame whose joints are known less well is refused, two sigma of its stamp included"},
    {"max_residual_mm", &SyncGate::max_residual_on_target, kMilli,
     "the same as what the laser plane moves by at the object"},
};
constexpr SettingsTable<SyncGate> kSync{kSyncRows};

using Scan = ScanSettings;
const Setting<Scan> kScanRows[] = {
    {"park_rad", &Scan::park, kAngle, "posture before and after a scan", Need::kRequired},
    {"posture_rad", &Scan::posture, kAngle, "posture of the sweep; its elbow is ignored", Need::kRequired},
    {"cycle_hz", &Scan::cycle_hz, ConfigRange(1, 10000),
     "rate of the cycle; at least four cycles in `control.feedback_timeout_s`"},
    {"", &Scan::capture, kCapture},
    {"sweep", &Scan::sweep, kSweep, Need::kRequired},
    {"move", &Scan::move, kMove},
    {"control", &Scan::control, kControl},
    {"limits", &Scan::limits, kLimits},
    {"real_time", &Scan::real_time, kRealTime},
    {"safety", &Scan::safety, kSafety},
    {"sync", &Scan::sync, kSync},
};

/// What the sweep's speed must keep to: the arm's slowest even motion, and the camera's rate.
void check_sweep_velocity(const ConfigNode& sweep, const ScanSettings& scan) {
  if (scan.sweep.velocity < scan.control.dead_zone[kElbow])
    sweep.fail("velocity_rad_s", "found '" + real(scan.sweep.velocity) + "', expected at least " +
                                     real(scan.control.dead_zone[kElbow]) + ": below it the arm sticks");
  const double duration = std::abs(scan.sweep.to - scan.sweep.from) / scan.sweep.velocity;
  if (duration < 2 * scan.capture.frame_period)
    sweep.fail("velocity_rad_s", "found '" + real(scan.sweep.velocity) + "', a sweep of " + rounded(duration) +
                                     " s, expected at least two frame periods of " +
                                     rounded(scan.capture.frame_period) + " s");
}

/// Cycles within the feedback timeout: with fewer, a late answer of the arm could not be told from silence.
constexpr double kCyclesPerTimeout = 4;
/// Cycles within the guardian's patience: one may be late.
constexpr double kCyclesPerGuard = 3;

}  // namespace

constinit const SettingsTable<ScanSettings> kScanKeys{kScanRows};

void check_scan_section(const ConfigNode& node, const ScanSettings& scan, const ArmModel& arm) {
  const auto check = [&](const ConfigNode& where, const char* key, int joint, double angle) {
    const JointLimit& limit = arm.limits[static_cast<std::size_t>(joint)];
    if (angle >= limit.lower && angle <= limit.upper) return;
    where.fail(key, std::string("found ") + kJointNames[static_cast<std::size_t>(joint)] + " at " + real(angle) +
                        " rad, expected " + real(limit.lower) + " to " + real(limit.upper) + " as in arm.limits_rad");
  };
  for (int i = 0; i < kJoints; ++i) {
    if (node.has("park_rad")) check(node, "park_rad", i, scan.park[i]);
    if (node.has("posture_rad") && i != kElbow) check(node, "posture_rad", i, scan.posture[i]);
  }
  if (const auto sweep = node.optional_child("sweep")) {
    check(*sweep, "from_rad", kElbow, scan.sweep.from);
    check(*sweep, "to_rad", kElbow, scan.sweep.to);
    if (scan.sweep.from == scan.sweep.to)
      sweep->fail("to_rad", "found the same angle as from_rad, expected another one");
    check_sweep_velocity(*sweep, scan);
  } else {
    check_sweep_velocity(node, scan);
  }
  const HeartbeatOutput& beat = scan.safety.heartbeat_output;
  if (beat.kind != HeartbeatKind::kNone && seconds(beat.half_period) * scan.cycle_hz < 2 * (1 - 1e-9))
    node.child("safety")
        .child("heartbeat_output")
        .fail("kind", "found a half_period_ms of " + real(1e3 * seconds(beat.half_period)) +
                          ", expected at least two cycles, " + rounded(2e3 / scan.cycle_hz));
  const double slowest_hz = kCyclesPerTimeout / scan.control.feedback_timeout;
  if (scan.cycle_hz < slowest_hz * (1 - 1e-9))
    node.fail("cycle_hz", "found '" + real(scan.cycle_hz) + "', expected at least " + rounded(slowest_hz) +
                              ", four cycles in control.feedback_timeout_s");
  const double three_cycles = kCyclesPerGuard / scan.cycle_hz;
  if (scan.safety.guardian_timeout < three_cycles * (1 - 1e-9))
    node.fail("cycle_hz", "found '" + real(scan.cycle_hz) + "', expected at least " +
                              rounded(kCyclesPerGuard / scan.safety.guardian_timeout) +
                              ", three cycles in safety.guardian_timeout_s");
  if (scan.capture.laser_pairs && !scan.capture.laser_switches_per_frame)
    node.fail("laser_pairs", "found true, expected false unless laser.switches_per_frame is true");
}

}  // namespace tankrig
