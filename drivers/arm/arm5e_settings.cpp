#include "drivers/arm/arm5e_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"
#include "drivers/can/can_timing.hpp"
#include "drivers/device_path.hpp"

namespace tankrig {
namespace {

constexpr double kUsualCanRate = 100, kUsualSerialRate = 50;  // the laboratory's cycle is 50 Hz

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

SerialSettings serial_from(const ConfigNode& node, const std::filesystem::path& runtime) {
  SerialSettings serial;
  serial.device = device_path(node.text("device"), runtime);
  serial.baud = node.integer_or("baud", serial.baud, {1200, 4'000'000});
  return serial;
}

PidGains gains_from(const ConfigNode& node, std::string_view key, PidGains gains) {
  if (!node.has(key)) return gains;
  const auto values = node.numbers(key, 3);
  for (const double v : values)
    if (v < 0 || v > 255 || v != std::floor(v))
      node.fail(key, fmt::format("found {:f}, expected whole numbers 0 .. 255", v));
  return {static_cast<std::uint8_t>(values[0]), static_cast<std::uint8_t>(values[1]),
          static_cast<std::uint8_t>(values[2])};
}

void read_homing(const ConfigNode& node, HomingSettings& homing) {
  homing.speed_ticks_per_s = node.integer_or("speed_ticks_per_s", homing.speed_ticks_per_s, {50, kLargestSpeed});
  homing.stop_current_a = node.number_or("stop_current_a", homing.stop_current_a, {0.05, 20});
  homing.pause = from_seconds(node.number_or("pause_s", seconds(homing.pause), {0.05, 60}));
  homing.longest = from_seconds(node.number_or("longest_s", seconds(homing.longest), {0.1, 600}));
  if (const auto directions = node.optional_child("direction"))
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (!directions->has(kJointNames[j])) continue;
      const std::string text = directions->choice(kJointNames[j], {"negative", "positive", "none"});
      homing.direction[j] = text == "negative"   ? HomeDirection::kNegative
                            : text == "positive" ? HomeDirection::kPositive
                                                 : HomeDirection::kNone;
    }
  if (const auto angles = node.optional_child("rest_angle_rad"))
    for (std::size_t j = 0; j < kJoints; ++j)
      homing.rest_angle[j] = angles->number_or(kJointNames[j], homing.rest_angle[j], {-7, 7});
}

void read_limits(const ConfigNode& arm, Arm5eSettings& s) {
  const auto raw12 = [&](const char* key, std::uint16_t fallback) {
    return static_cast<std::uint16_t>(arm.integer_or(key, fallback, {0, kLargestSpeed}));
  };
  s.speed_limit = raw12("speed_limit_raw", s.speed_limit);
  s.current_limit = raw12("current_limit_raw", s.current_limit);
  s.jaw_current_limit = raw12("jaw_current_limit_raw", s.jaw_current_limit);
  s.over_current.amperes = arm.number_or("over_current_a", s.over_current.amperes, {0.1, 50});
  s.over_current.duration = from_seconds(arm.number_or("over_current_s", seconds(s.over_current.duration), {0, 60}));
  s.water_ingress_raw = arm.integer_or("water_ingress_raw", s.water_ingress_raw, {1, 256});
  s.posture_margin = arm.number_or("posture_margin_rad", s.posture_margin, {0, 1});
}

void read_shaping(const ConfigNode& arm, VelocityShaping& shaping) {
  shaping.creep = arm.number_or("creep_rad_s", shaping.creep, {0, 1});
  shaping.max_ticks_per_s = arm.number_or("max_ticks_per_s", shaping.max_ticks_per_s, {1, kLargestSpeed});
  if (!arm.has("dead_zone_rad_s")) return;
  const auto values = arm.numbers("dead_zone_rad_s", kJoints);
  for (int j = 0; j < kJoints; ++j) shaping.dead_zone[j] = values[static_cast<std::size_t>(j)];
}

}  // namespace

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
  Arm5eSettings s;
  const std::string own = arm.choice("carrier", {"can", "serial"});
  const std::string name = carrier.empty() ? own : carrier;
  s.carrier = name == "can" ? ArmCarrier::kCan : ArmCarrier::kSerial;
  const auto can = arm.optional_child("can");
  const auto serial = arm.optional_child("serial");
  const auto& chosen = s.carrier == ArmCarrier::kCan ? can : serial;
  if (!chosen) arm.fail("carrier", "found no section " + name + ":, expected one for the carrier " + name);
  const auto rate = [&](const std::optional<ConfigNode>& section, double usual) {
    const double hz = section ? section->number_or("exchange_rate_hz", usual, {1, 1000}) : usual;
    if (&section == &chosen) s.exchange_rate_hz = hz;
  };
  rate(can, kUsualCanRate);
  rate(serial, kUsualSerialRate);
  if (can) {
    s.can = can_settings_from(*can, runtime);
    if (const auto ids = can->optional_child("ids")) s.can_ids = arm_can_ids_from(*ids);
    if (can->has("fast_joint")) {
      const std::string joint = can->choice("fast_joint", {kJointNames.begin(), kJointNames.end()});
      s.fast_joint = static_cast<Joint>(std::find(kJointNames.begin(), kJointNames.end(), joint) - kJointNames.begin());
    }
  }
  if (serial) s.serial = serial_from(*serial, runtime);
  s.can.filters = s.can_ids.arm_filters();
  const std::string text = overload(s);
  if (!text.empty()) chosen->fail(chosen->has("exchange_rate_hz") ? "exchange_rate_hz" : chosen->keys().front(), text);

  s.encoder_latency = arm.milliseconds_or("encoder_latency_ms", s.encoder_latency, {0, 500});
  s.reply_timeout = arm.milliseconds_or("reply_timeout_ms", s.reply_timeout, {1, 1000});
  s.silence_timeout = arm.milliseconds_or("silence_timeout_ms", s.silence_timeout, {10, 10'000});
  if (const std::string late = slow_round(s); !late.empty())
    chosen->fail(chosen->has("exchange_rate_hz") ? "exchange_rate_hz" : "fast_joint", late);
  s.watchdog = arm.milliseconds_or("watchdog_ms", s.watchdog, {20, 10'000});
  if (arm.has("zero_file")) {
    const std::string file = arm.text("zero_file");
    s.zero_file =
        file.starts_with("runtime/") ? std::filesystem::path(device_path(file, runtime)) : arm.path("zero_file");
  }
  read_shaping(arm, s.shaping);
  read_limits(arm, s);
  if (const auto pid = arm.optional_child("pid")) {
    s.pid.position = gains_from(*pid, "position", s.pid.position);
    s.pid.speed = gains_from(*pid, "speed", s.pid.speed);
  }
  if (const auto encoder = arm.optional_child("encoder")) {
    s.encoder.jump_ticks = encoder->integer_or("jump_ticks", s.encoder.jump_ticks, {10, 32'000});
    s.encoder.persists_samples = encoder->integer_or("persists_samples", s.encoder.persists_samples, {2, 1000});
  }
  if (arm.has("joint_current"))
    s.tail = arm.choice("joint_current", {"master", "le16"}) == "le16" ? TailMeaning::kLe16 : TailMeaning::kMaster;
  if (arm.has("scaling"))
    s.scaling = arm.choice("scaling", {"laboratory", "micro"}) == "micro" ? micro_scaling() : laboratory_scaling();
  if (const auto homing = arm.optional_child("homing")) read_homing(*homing, s.homing);
  return s;
}

}  // namespace tankrig
