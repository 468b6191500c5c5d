#include "drivers/arm/arm5e_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "drivers/can/can_timing.hpp"
#include "drivers/device_path.hpp"

namespace tankrig {
namespace {

std::string overload(const Arm5eSettings& settings) {
  const CarrierLoad carrier = carrier_load(settings);
  if (carrier.load <= kLargestCarrierLoad) return {};
  return fmt::format("found {:.6g} exchanges/s, a load of {:.1f} % ({}), expected at most {:.4g}/s ({:.0f} %)",
                     settings.exchange_rate_hz, 100 * carrier.load, carrier.text,
                     std::floor(10 * kLargestCarrierLoad * carrier.largest_rate_hz) / 10, 100 * kLargestCarrierLoad);
}

/// The others must be heard of well before they are missed.
std::string slow_round(const Arm5eSettings& settings) {
  const double round_s = ExchangeSchedule::kFastRound / settings.exchange_rate_hz;
  if (settings.carrier != ArmCarrier::kCan || !settings.fast_joint || 2 * round_s <= seconds(settings.silence_timeout))
    return {};
  const int round = ExchangeSchedule::kFastRound;
  return fmt::format(
      "found {:.6g} exchanges/s: with a fast_joint the others take {} exchanges, {:.3g} s, expected at most half of "
      "silence_timeout_ms",
      settings.exchange_rate_hz, round, round_s);
}

/// As a rig file has them: a rate for each carrier.
struct ArmKeys : Arm5eSettings {
  double can_rate_hz = 100, serial_rate_hz = 50;  ///< usual ones; the laboratory's cycle is 50 Hz
};

constexpr ConfigRange kRate{1, 1000}, kRaw12{0, kLargestSpeed}, kSpeedRange{0, 10};

const Setting<ArmKeys> kArmCanRows[] = {
    {"", &ArmKeys::can, kCanKeys},
    {"exchange_rate_hz", &ArmKeys::can_rate_hz, kRate, "a request and its answer; at most 70 % of what the wire can"},
    {"fast_joint", &ArmKeys::fast_joint, "in every exchange, the others in turn; none: all in all of them"},
    {"ids", &ArmKeys::can_ids, kArmCanIdKeys},
};
constexpr SettingsTable<ArmKeys> kArmCan{kArmCanRows};

const Setting<SerialSettings> kArmLineRows[] = {
    {"device", &SerialSettings::device, "/dev/ttyUSB0, or runtime/NAME for an emulated one", Need::kRequired},
    {"baud", &SerialSettings::baud, ConfigRange(1200, 4'000'000), "of the line"},
};
constexpr SettingsTable<SerialSettings> kArmLine{kArmLineRows};
const Setting<ArmKeys> kArmSerialRows[] = {
    {"", &ArmKeys::serial, kArmLine},
    {"exchange_rate_hz", &ArmKeys::serial_rate_hz, kRate, "as above"},
};
constexpr SettingsTable<ArmKeys> kArmSerial{kArmSerialRows};

template <PidGains PidSlot::*gains>
Setting<PidSlot> gains_setting(const char* key) {
  return {key,
          {[](const ConfigNode& node, const char* at, PidSlot& pid) {
             const auto values = read_value<std::array<std::uint8_t, 3>>(node, at, {0, 255});
             pid.*gains = {values[0], values[1], values[2]};
           },
           [](YAML::Emitter& out, const PidSlot& pid) {
             emit_list(out, std::array{(pid.*gains).p, (pid.*gains).i, (pid.*gains).d});
           },
           "three whole numbers, each 0 to 255"},
          "gains P, I, D, sent once after power-up"};
}
const Setting<PidSlot> kPidRows[] = {gains_setting<&PidSlot::position>("position"),
                                     gains_setting<&PidSlot::speed>("speed")};
constexpr SettingsTable<PidSlot> kPid{kPidRows};

const Setting<EncoderTrackSettings> kEncoderRows[] = {
    {"jump_ticks", &EncoderTrackSettings::jump_ticks, ConfigRange(10, 32'000),
     "a reading this near to where the last speed takes the encoder is believed"},
    {"persists_samples", &EncoderTrackSettings::persists_samples, ConfigRange(2, 1000),
     "so many in a row that agree are believed all the same"},
};
constexpr SettingsTable<EncoderTrackSettings> kEncoder{kEncoderRows};

void read_directions(const ConfigNode& node, const char* key, HomingSettings& homing) {
  const ConfigNode joints = node.child(key);
  for (std::size_t j = 0; j < kJoints; ++j)
    if (joints.has(kJointNames[j])) homing.direction[j] = read_value<HomeDirection>(joints, kJointNames[j], {});
}
void write_directions(YAML::Emitter& out, const HomingSettings& homing) {
  out << YAML::Flow << YAML::BeginMap;
  for (std::size_t j = 0; j < kJoints; ++j) out << kJointNames[j] << name_of(homing.direction[j]);
  out << YAML::EndMap;
}
void read_rest_angles(const ConfigNode& node, const char* key, HomingSettings& homing) {
  const ConfigNode joints = node.child(key);
  for (std::size_t j = 0; j < kJoints; ++j)
    homing.rest_angle[j] = joints.number_or(kJointNames[j], homing.rest_angle[j], {-7, 7});
}

const Setting<HomingSettings> kHomingRows[] = {
    {"speed_ticks_per_s", &HomingSettings::speed_ticks_per_s, ConfigRange(50, kLargestSpeed),
     "into the stop, the first time; at most `scan: limits: ticks_per_s`"},
    {"slow_ticks_per_s", &HomingSettings::slow_ticks_per_s, ConfigRange(50, kLargestSpeed),
     "out of it and into it again, whose reading counts; below their dead zone axes stick"},
    {"back_off_ticks", &HomingSettings::back_off_ticks, ConfigRange(10, 10'000), "out of the stop, between the two"},
    {"agreement_ticks", &HomingSettings::agreement_ticks, ConfigRange(1, 1000),
     "largest distance between the two stops found, and from a zero that still held"},
    {"stop_current_a", &HomingSettings::stop_current_a, ConfigRange(0.05, 20),
     "of the whole arm: an axis that stands above it is at its stop"},
    {"pause_s", &HomingSettings::pause, ConfigRange(0.05, 60), "between axes"},
    {"longest_s", &HomingSettings::longest, ConfigRange(0.1, 600), "for one axis"},
    {"direction",
     {read_directions, write_directions, "negative, positive or none by joint name"},
     "of the actuator's ticks; none: the axis has no stop"},
    {"rest_angle_rad",
     {read_rest_angles, nullptr, "-7 to 7 by joint name"},
     "of an axis without a stop, where it stands; left out: 0"},
};
void check_slow(const ConfigNode& node, const HomingSettings& homing) {
  if (homing.slow_ticks_per_s > homing.speed_ticks_per_s)
    node.fail(node.has("slow_ticks_per_s") ? "slow_ticks_per_s" : "speed_ticks_per_s",
              fmt::format("found a slow_ticks_per_s of {}, expected at most speed_ticks_per_s, {}",
                          homing.slow_ticks_per_s, homing.speed_ticks_per_s));
}
constexpr SettingsTable<HomingSettings> kHoming{kHomingRows, check_slow};

void read_zero_file(const ConfigNode& node, const char* key, ArmKeys& arm) {
  const std::string file = node.text(key);
  arm.zero_file = file.starts_with("runtime/") ? std::filesystem::path(file) : node.path(key);
}
void read_scaling(const ConfigNode& node, const char* key, ArmKeys& arm) {
  arm.scaling = node.choice(key, {"laboratory", "micro"}) == "micro" ? micro_scaling() : laboratory_scaling();
}

const Setting<VelocityShaping> kShapingRows[] = {
    {"creep_rad_s", &VelocityShaping::creep, ConfigRange(0, 1), "slower set-points are rest"},
    {"dead_zone_rad_s", &VelocityShaping::dead_zone, kSpeedRange, "slower ones are raised to this"},
    {"max_ticks_per_s", &VelocityShaping::max_ticks_per_s, ConfigRange(1, kLargestSpeed),
     "all axes are slowed together"},
};
constexpr SettingsTable<VelocityShaping> kShaping{kShapingRows};

const Setting<OverCurrentLimit> kOverCurrentRows[] = {
    {"over_current_a", &OverCurrentLimit::amperes, ConfigRange(0.1, 50), "of the whole arm: above it for"},
    {"over_current_s", &OverCurrentLimit::duration, ConfigRange(0, 60), "so long, the arm is stopped"},
};
constexpr SettingsTable<OverCurrentLimit> kOverCurrent{kOverCurrentRows};

const Setting<ArmKeys> kArmKeyRows[] = {
    {"driver",
     {[](const ConfigNode& node, const char* key, ArmKeys&) { static_cast<void>(node.choice(key, {"arm5e"})); },
      nullptr, "arm5e"},
     "the only one"},
    {"carrier", &ArmKeys::carrier, "both sections may stand here; `--carrier` chooses for one run", Need::kRequired},
    {"can", kArmCan},
    {"serial", kArmSerial},
    {"zero_file",
     {read_zero_file, nullptr, "a file, or runtime/NAME"},
     "written by every command that moves the arm; none: not homed at start"},
    {"encoder_latency_ms", &ArmKeys::encoder_latency, ConfigRange(0, 500),
     "from reading the encoders to the answer's first bit"},
    {"reply_timeout_ms", &ArmKeys::reply_timeout, ConfigRange(1, 1000), "beyond the wire's own time"},
    {"silence_timeout_ms", &ArmKeys::silence_timeout, ConfigRange(10, 10'000), "without an answer: `arm: silent`"},
    {"watchdog_ms", &ArmKeys::watchdog, ConfigRange(20, 10'000),
     "without a set-point the driver stops the arm; must exceed the laser's caller_timeout_ms"},
    {"", &ArmKeys::shaping, kShaping},
    {"speed_limit_raw", &ArmKeys::speed_limit, kRaw12, "sent with every demand"},
    {"current_limit_raw", &ArmKeys::current_limit, kRaw12, "likewise"},
    {"jaw_current_limit_raw", &ArmKeys::jaw_current_limit, kRaw12, "of the jaw's opening"},
    {"", &ArmKeys::over_current, kOverCurrent},
    {"water_ingress_raw", &ArmKeys::water_ingress_raw, ConfigRange(1, 256), "at or above it, likewise"},
    {"posture_margin_rad", &ArmKeys::posture_margin, ConfigRange(0, 1),
     "a homed arm farther outside its limits has lost its zero"},
    {"pid", &ArmKeys::pid, kPid},
    {"encoder", &ArmKeys::encoder, kEncoder},
    {"joint_current", &ArmKeys::tail, "what the disputed bytes of a sensor slot are"},
    {"scaling",
     {read_scaling, [](YAML::Emitter& out, const ArmKeys&) { out << "laboratory"; }, "laboratory, micro"},
     "raw counts to units"},
    {"homing", &ArmKeys::homing, kHoming},
};
constexpr SettingsTable<ArmKeys> kArmKeys{kArmKeyRows};

/// Beyond an axis' range, for limits that are not exactly where its stops are.
constexpr double kRangeShare = 1.05, kRangeTicks = 100;

}  // namespace

double HomingSettings::range_ticks(const ArmModel& model, Joint joint) const {
  const Actuator& actuator = model.actuators[joint];
  const JointLimit& limit = model.limits[joint];
  return kRangeShare * std::abs(actuator.ticks(limit.upper) - actuator.ticks(limit.lower)) + kRangeTicks;
}

CarrierLoad carrier_load(const Arm5eSettings& settings) {
  CarrierLoad carrier;
  double exchange_s = 0;
  if (settings.carrier == ArmCarrier::kCan) {
    const bool fast = settings.fast_joint.has_value();
    const int bits = can_exchange_bits(fast);
    exchange_s = static_cast<double>(bits) / settings.can.bitrate;
    carrier.text =
        fmt::format("{} frames of together {} bits at most, at {} bit/s", fast ? 3 : 11, bits, settings.can.bitrate);
  } else {
    exchange_s = 2 * seconds(serial_frame_time(settings.serial));
    carrier.text = fmt::format("51 bytes each way at {} baud", settings.serial.baud);
  }
  carrier.largest_rate_hz = 1 / exchange_s;
  carrier.load = settings.exchange_rate_hz * exchange_s;
  return carrier;
}

void check_carrier_load(const Arm5eSettings& settings) {
  const std::string text = overload(settings);
  if (!text.empty()) throw InputError("arm: exchange_rate_hz: " + text);
}

Arm5eSettings arm5e_settings_from(const ConfigNode& arm, const std::filesystem::path& runtime,
                                  const std::string& carrier) {
  ArmKeys s;
  read_settings(arm, kArmKeys, s);
  if (!carrier.empty()) s.carrier = carrier == "can" ? ArmCarrier::kCan : ArmCarrier::kSerial;
  const auto can = arm.optional_child("can"), chosen = arm.optional_child(name_of(s.carrier));
  if (!chosen)
    arm.fail("carrier", std::string("found no section ") + name_of(s.carrier) + ":, expected one for the carrier " +
                            name_of(s.carrier));
  s.exchange_rate_hz = s.carrier == ArmCarrier::kCan ? s.can_rate_hz : s.serial_rate_hz;
  if (can) s.can = can_settings_from(*can, runtime);
  s.can.filters = s.can_ids.arm_filters();
  s.serial.device = device_path(s.serial.device, runtime);
  s.zero_file = device_path(s.zero_file.string(), runtime);
  if (const std::string text = overload(s); !text.empty())
    chosen->fail(chosen->has("exchange_rate_hz") ? "exchange_rate_hz" : chosen->keys().front(), text);
  if (const std::string late = slow_round(s); !late.empty())
    chosen->fail(chosen->has("exchange_rate_hz") ? "exchange_rate_hz" : "fast_joint", late);
  return s;
}

std::string arm5e_rows(const std::string& place) { return settings_rows(place, kArmKeys); }

}  // namespace tankrig
