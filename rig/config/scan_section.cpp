#include "rig/config/scan_section.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/settings_table.hpp"
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

void read_pace(const ConfigNode& node, const char* key, RealTimeSettings& s) {
  s.pace = node.choice(key, {"clock", "device"}) == "device" ? CyclePace::kDevice : CyclePace::kClock;
}
void write_pace(YAML::Emitter& out, const RealTimeSettings& s) {
  out << (s.pace == CyclePace::kDevice ? "device" : "clock");
}

void read_waived(const ConfigNode& node, const char* key, BeamSettings& s) { s.waived = node.texts(key); }
void write_waived(YAML::Emitter& out, const BeamSettings& s) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const std::string& camera : s.waived) out << YAML::DoubleQuoted << camera;
  out << YAML::EndSeq;
}

using Scan = ScanSettings;
const Setting<Scan> kScan[] = {
    {"park_rad", &Scan::park, kAngle, "posture before and after a scan", true},
    {"posture_rad", &Scan::posture, kAngle, "posture of the sweep; its elbow is ignored", true},
    {"cycle_hz",
     &Scan::cycle_hz,
     {1, 10000},
     "rate of the cycle; at least four cycles in `control.feedback_timeout_s`"},
};
const Setting<CaptureSettings> kCapture[] = {
    {"dark_frames",
     &CaptureSettings::dark_frames,
     {0, 10000},
     "frames of each camera before and after the sweep, laser off, arm at rest"},
    {"camera_lead_s", &CaptureSettings::camera_lead, kTime, "a camera runs this long before its phase"},
    {"laser_pairs",
     &CaptureSettings::laser_pairs,
     {},
     "laser on in every second frame of the sweep only; needs `laser: switches_per_frame`"},
};
const Setting<SweepSettings> kSweep[] = {
    {"from_rad", &SweepSettings::from, kAngle, "elbow where the recorded sweep begins", true},
    {"to_rad", &SweepSettings::to, kAngle, "elbow where it ends", true},
    {"velocity_rad_s", &SweepSettings::velocity, kVelocity, "of the elbow; at least its dead zone", true},
    {"acceleration_rad_s2", &SweepSettings::acceleration, kAcceleration, "of the ramps"},
    {"jerk_rad_s3", &SweepSettings::jerk, kJerk, "of the ramps"},
    {"lead_in_s", &SweepSettings::lead_in, kTime,
     "constant velocity before the first recorded frame: backlash is taken up"},
    {"passes",
     &SweepSettings::passes,
     {1, 100},
     "sweeps; the lines of pass k lie k / passes of a line spacing beside pass 0"},
    {"there_and_back",
     &SweepSettings::there_and_back,
     {},
     "odd passes sweep backwards; false: the elbow returns first"},
};
const Setting<MoveSettings> kMove[] = {
    {"velocity_rad_s", &MoveSettings::velocity, kVelocity, "of the fastest joint, between postures"},
    {"acceleration_rad_s2", &MoveSettings::acceleration, kAcceleration, "of the ramps"},
    {"jerk_rad_s3", &MoveSettings::jerk, kJerk, "of the ramps"},
    {"settle_s", &MoveSettings::settle, kTime, "rest before a dark block and before a sweep"},
};
const Setting<ControlSettings> kControl[] = {
    {"position_gain_per_s", &ControlSettings::position_gain, {0, 100}, "velocity correction per position error"},
    {"learning_rate_per_s2",
     &ControlSettings::learning_rate,
     {0, 100},
     "relative velocity correction per second and second of trail"},
    {"feed_forward_lead_s",
     &ControlSettings::feed_forward_lead,
     {0, 1},
     "planned velocities are sent this much early: lag of actuators and carrier"},
    {"dead_zone_rad_s",
     &ControlSettings::dead_zone,
     {0, 2},
     "slowest even speed of each joint; slower set-points become it or rest"},
    {"following_error_limit_rad",
     &ControlSettings::following_error_limit,
     {0.0001, 1},
     "planned minus measured, any joint; more is a fault"},
    {"feedback_timeout_s", &ControlSettings::feedback_timeout, kTimeout, "longest silence of the arm"},
    {"heartbeat_timeout_s", &ControlSettings::heartbeat_timeout, kTimeout,
     "longest silence of whoever supervises the cycle"},
    {"max_joint_gap_s", &ControlSettings::max_joint_gap, kTimeout,
     "widest pair of joint samples that a frame is interpolated between"},
};
const Setting<JointLimits> kLimits[] = {
    {"beyond_rad", &JointLimits::beyond, {0, 0.2}, "how far beyond its limit a joint may stand: backlash, a soft stop"},
    {"refusal_margin_rad",
     &JointLimits::refusal_margin,
     {0, 1},
     "nearer to a limit, a set-point towards it is refused unless the plan goes there"},
    {"velocity_rad_s", &JointLimits::velocity, {0.01, 10}, "measured, any joint"},
    {"ticks_per_s", &JointLimits::ticks_per_s, {1, 1e6}, "measured, any actuator"},
    {"velocity_window_ms", &JointLimits::velocity_window, {10, 1000}, "both are measured over so long"},
    {"set_point_step_rad_s",
     &JointLimits::set_point_step,
     {0, 10},
     "largest change from one velocity set-point to the next; 0: any"},
};
const Setting<OverCurrentLimit> kCurrent[] = {
    {"current_a", &OverCurrentLimit::amperes, {0.1, 50}, "supply current of the whole arm"},
    {"current_s", &OverCurrentLimit::duration, {0, 60}, "so long above it is a fault"},
};
const Setting<RealTimeSettings> kRealTime[] = {
    {"required",
     &RealTimeSettings::required,
     {},
     "false: what the system does not grant is told, and the scan goes on without it"},
    {"priority", &RealTimeSettings::priority, {1, 98}, "of SCHED_FIFO"},
    {"cpu",
     OtherValue<RealTimeSettings>{read_cpu, write_cpu, "none, or a processor's number"},
     {},
     "the only processor the cycle runs on"},
    {"lock_memory", &RealTimeSettings::lock_memory, {}, "the process's memory stays where it is"},
    {"pace",
     OtherValue<RealTimeSettings>{read_pace, write_pace, "clock or device"},
     {},
     "device: the cycle keeps step with an arm that samples by its own clock"},
};
const Setting<RealTimeSettings> kOverruns[] = {
    {"limit",
     &RealTimeSettings::overruns,
     {0, 10'000},
     "so many late cycles within the window stop the scan; 0: they are only counted"},
    {"window_s", &RealTimeSettings::window, {0.001, 600}, "the window"},
};
const Setting<SafetySettings> kSafety[] = {
    {"indicator_delay_s", &SafetySettings::indicator_delay, {1, 60}, "from arming to the first light, at least"},
    {"maximum_on_s",
     &SafetySettings::maximum_on,
     {1, 3600},
     "longest stretch of light; it ends when it has been dark for indicator_delay_s"},
    {"hold_limit_s",
     &SafetySettings::hold_limit,
     {1, 3600},
     "longest light with the arm at rest that an operator asks for once; at most maximum_on_s"},
    {"laser_off_allowance_s",
     &SafetySettings::laser_off_allowance,
     {0.01, 5},
     "longest the laser may stay powered or lit when it is not commanded"},
    {"laser_on_margin_s",
     &SafetySettings::laser_on_margin,
     {0.01, 5},
     "longest it may stay dark beyond its warm-up when it is commanded"},
    {"rest_velocity_rad_s", &SafetySettings::rest_velocity, {0.001, 0.1}, "a joint slower than this is at rest"},
    {"rest_timeout_s",
     &SafetySettings::rest_timeout,
     {0.2, 60},
     "after the end, longest wait for laser dark and arm at rest"},
    {"camera_timeout_s",
     &SafetySettings::camera_timeout,
     {0.1, 60},
     "longest silence of a camera that has begun to deliver"},
};
const Setting<BeamSettings> kBeam[] = {
    {"verify", &BeamSettings::verify, {}, "compares what cameras see with what the laser's device says"},
    {"frames",
     &BeamSettings::frames,
     {2, 100},
     "so many frames of one camera in a row against the laser's word are a fault"},
    {"dark_frames",
     &BeamSettings::dark_frames,
     {1, 100},
     "of a camera, before the first light; at most the scan's own"},
    {"waived",
     OtherValue<BeamSettings>{read_waived, write_waived, "names of cameras"},
     {},
     "cameras that do not testify"},
};
const Setting<SyncGate> kSync[] = {
    {"max_residual_ms", &SyncGate::max_residual, kMilli,
     "a frame whose joints are known less well in time, two sigma of its stamp included, is refused"},
    {"max_residual_mm", &SyncGate::max_residual_on_target, kMilli,
     "the same as what the laser plane moves by at the object"},
};

/// Calls visit(path, table, settings) for every table of the section, in the order in which they stand in a file: `path`
/// is where its mapping lies below `scan`, "" for the section itself. `scan` may be const.
template <class ScanLike, class Visit>
void for_each_table(ScanLike& scan, Visit visit) {
  const auto table = [&visit]<class S, std::size_t N>(const char* path, const Setting<S>(&rows)[N], auto& settings) {
    visit(path, std::span<const Setting<S>>(rows), settings);
  };
  table("", kScan, scan);
  table("", kCapture, scan.capture);
  table("sweep", kSweep, scan.sweep);
  table("move", kMove, scan.move);
  table("control", kControl, scan.control);
  table("limits", kLimits, scan.limits);
  table("limits", kCurrent, scan.limits.current);
  table("real_time", kRealTime, scan.real_time);
  table("real_time.overruns", kOverruns, scan.real_time);
  table("safety", kSafety, scan.safety);
  table("safety.beam", kBeam, scan.safety.beam);
  table("sync", kSync, scan.sync);
}

std::optional<ConfigNode> below(const ConfigNode& node, std::string_view path) {
  std::optional<ConfigNode> at = node;
  while (at && !path.empty()) {
    const std::size_t dot = std::min(path.find('.'), path.size());
    at = at->optional_child(path.substr(0, dot));
    path.remove_prefix(std::min(path.size(), dot + 1));
  }
  return at;
}

std::string real(double value) { return exact_text(value); }
std::string rounded(double value) {
  char buffer[32];
  return {buffer, static_cast<std::size_t>(std::snprintf(buffer, sizeof buffer, "%.4g", value))};
}

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

void check_hold_limit(const ConfigNode& node, const SafetySettings& s) {
  if (s.hold_limit > s.maximum_on)
    node.fail(
        node.has("hold_limit_s") ? "hold_limit_s" : "maximum_on_s",
        "found a hold_limit_s of " + real(s.hold_limit) + ", expected at most maximum_on_s, " + real(s.maximum_on));
}

}  // namespace

void read_scan_section(const ConfigNode& node, bool complete, ScanSettings& scan, bool& read_lux) {
  if (complete) static_cast<void>(node.child("sweep"));  // must be there
  for_each_table(scan, [&](const char* path, auto table, auto& settings) {
    if (const auto child = below(node, path)) read_settings(*child, table, settings, complete);
  });
  if (const auto safety = node.optional_child("safety")) check_hold_limit(*safety, scan.safety);
  read_lux = node.flag_or("read_lux", read_lux);
}

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
  const double slowest_hz = kCyclesPerTimeout / scan.control.feedback_timeout;
  if (scan.cycle_hz < slowest_hz * (1 - 1e-9))
    node.fail("cycle_hz", "found '" + real(scan.cycle_hz) + "', expected at least " + rounded(slowest_hz) +
                              ", four cycles in control.feedback_timeout_s");
  if (scan.capture.laser_pairs && !scan.capture.laser_switches_per_frame)
    node.fail("laser_pairs", "found true, expected false unless laser.switches_per_frame is true");
}

std::string scan_section_yaml(const ScanSettings& scan, bool read_lux) {
  YAML::Emitter out;
  std::string open;  // path of the mappings that are open
  const auto depth = [](const std::string& path) {
    return path.empty() ? 0 : 1 + std::count(path.begin(), path.end(), '.');
  };
  out << YAML::BeginMap;
  for_each_table(scan, [&](const std::string& path, auto table, const auto& settings) {
    if (path != open) {
      const bool deeper = !open.empty() && path.starts_with(open + ".");
      for (auto n = deeper ? 0 : depth(open); n > 0; --n) out << YAML::EndMap;
      out << YAML::Key << path.substr(deeper ? open.size() + 1 : 0) << YAML::Value << YAML::BeginMap;
      open = path;
    }
    write_settings(out, table, settings);
  });
  for (auto n = depth(open); n > 0; --n) out << YAML::EndMap;
  out << YAML::Key << "read_lux" << YAML::Value << read_lux << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string scan_section_table() {
  std::string out = "| key | default | expected | |\n|---|---|---|---|\n";
  const ScanSettings defaults;
  for_each_table(defaults, [&](const std::string& path, auto table, const auto& settings) {
    out += settings_rows("scan" + (path.empty() ? "" : "." + path), table, settings);
  });
  return out + "| `scan.read_lux` | true | true or false | ask the lux meter before and after the sweep |\n";
}

}  // namespace tankrig
