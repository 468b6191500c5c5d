// The rig file's `devices: arm:` section for the driver arm5e.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "drivers/arm/can_arm_link.hpp"
#include "drivers/arm/encoder_track.hpp"
#include "drivers/arm/over_current.hpp"
#include "drivers/arm/serial_arm_link.hpp"
#include "drivers/arm/velocity_demand.hpp"

namespace tankrig {

enum class ArmCarrier : std::uint8_t { kCan, kSerial };
template <>
inline constexpr std::array kNames<ArmCarrier>{"can", "serial"};

/// kNone: the axis has no stop; its posture counts as its rest angle.
enum class HomeDirection : std::uint8_t { kNegative, kPositive, kNone };
template <>
inline constexpr std::array kNames<HomeDirection>{"negative", "positive", "none"};

/// Directions are the actuator's: negative means fewer ticks.
/// Source: the laboratory's public start-up file homes slew, shoulder and elbow at speed 1500, negative, until the arm
/// draws 1 A, with 5 s between axes; the wrist is not homed.
struct HomingSettings {
  std::array<HomeDirection, kJoints> direction{HomeDirection::kNegative, HomeDirection::kNegative,
                                               HomeDirection::kNegative, HomeDirection::kNone, HomeDirection::kNone};
  std::array<double, kJoints> rest_angle{};  ///< of the axes without a stop [rad]
  int speed_ticks_per_s = 1500;
  int slow_ticks_per_s = 700;  ///< the second time; slower, the real axes stick
  int back_off_ticks = 300;    ///< out of the stop, between the two
  int agreement_ticks = 20;    ///< between the two stops found, and between a zero that still held and the new one
  double stop_current_a = 1;   ///< of the whole arm; a standing axis above it is at its stop
  Duration pause = std::chrono::seconds(5);
  Duration longest = std::chrono::seconds(40);  ///< one axis; the longest, the shoulder, takes 15 s at 1500 ticks/s

  /// No axis travels more on its way to a stop.
  double range_ticks(const ArmModel& model, Joint joint) const;
};

/// Source of the defaults: docs/reference/arm5e.md.
struct Arm5eSettings {
  ArmCarrier carrier = ArmCarrier::kCan;
  CanSettings can;
  ArmCanIds can_ids;
  SerialSettings serial;
  double exchange_rate_hz = 100;    ///< a request and its answer; at most 70 % of what the carrier can
  std::optional<Joint> fast_joint;  ///< on CAN: in every exchange, the others in turn; empty: all joints in all
  Duration encoder_latency{};       ///< from reading the encoders to the first bit of the answer
  Duration reply_timeout = std::chrono::milliseconds(20);     ///< beyond the wire's own time
  Duration silence_timeout = std::chrono::milliseconds(250);  ///< without an answer the arm is lost
  Duration watchdog = std::chrono::milliseconds(500);         ///< without a set-point the arm is stopped
  std::filesystem::path zero_file;                            ///< empty: not homed at start
  VelocityShaping shaping;
  std::uint16_t speed_limit = 0x0FFF, current_limit = 0x0FFF;  ///< of every demand [raw]
  std::uint16_t jaw_current_limit = 0x00FF;                    ///< of the jaw's opening [raw]
  PidSlot pid{{0, 0, 0}, {255, 4, 0}};
  EncoderTrackSettings encoder;
  TailMeaning tail = TailMeaning::kMaster;
  ArmScaling scaling = laboratory_scaling();
  OverCurrentLimit over_current;
  int water_ingress_raw = 1;     ///< at or above it a joint reports water
  double posture_margin = 0.05;  ///< outside its limits by more, a homed arm is not where it thinks it is [rad]
  HomingSettings homing;
};

inline constexpr double kLargestCarrierLoad = 0.70;

/// The load of an exchange rate on its carrier.
struct CarrierLoad {
  double load = 0;             ///< share of the carrier's time
  double largest_rate_hz = 0;  ///< at which the load is 1
  std::string text;            ///< what one exchange is made of, for messages
};
CarrierLoad carrier_load(const Arm5eSettings& settings);

/// Errors: InputError when the load is above 70 %, naming rate, load and the largest rate allowed.
void check_carrier_load(const Arm5eSettings& settings);

/// The caller finishes the section. Paths that begin with "runtime/" are in `runtime`.
/// `carrier`: "can" or "serial" instead of the section's own; empty: its own.
/// Errors: InputError with line.
Arm5eSettings arm5e_settings_from(const ConfigNode& arm, const std::filesystem::path& runtime,
                                  const std::string& carrier = {});
/// Its keys, as rows of a Markdown table.
std::string arm5e_rows(const std::string& place);

}  // namespace tankrig
