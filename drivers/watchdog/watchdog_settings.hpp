// What tells a watchdog box that the program is alive, and what tells the program that the box feeds arm and laser.
#pragma once

#include <array>
#include <string>

#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "core/time.hpp"

namespace tankrig {

enum class HeartbeatKind : std::uint8_t { kNone, kRts, kDtr, kBytes, kGpio };
template <>
inline constexpr std::array kNames<HeartbeatKind>{"none", "rts", "dtr", "bytes", "gpio"};

enum class EnableKind : std::uint8_t { kNone, kCts, kDsr, kDcd, kRi, kReply, kGpio };
template <>
inline constexpr std::array kNames<EnableKind>{"none", "cts", "dsr", "dcd", "ri", "reply", "gpio"};

/// The rig file's `scan: safety: heartbeat_output:`.
struct HeartbeatOutput {
  HeartbeatKind kind = HeartbeatKind::kNone;
  std::string device{};  ///< a serial line
  std::string chip{};    ///< of gpio
  int line = -1;         ///< of gpio, on the chip; -1: not said
  int baud = 115'200;    ///< of bytes
  Duration half_period = std::chrono::milliseconds(20);
};

/// The rig file's `scan: safety: enable_input:`.
struct EnableInput {
  EnableKind kind = EnableKind::kNone;
  std::string device{};      ///< empty: the heartbeat's
  std::string chip{};        ///< of gpio; empty: the heartbeat's
  int line = -1;             ///< of gpio, on the chip; -1: not said
  bool closed_is_on = true;  ///< of a control line: on (a positive voltage) means enabled; of gpio: high
  Duration wait = std::chrono::seconds(60);
};

struct WatchdogSettings {
  HeartbeatOutput heartbeat{};
  EnableInput enable{};
};

extern const SettingsTable<HeartbeatOutput> kHeartbeatOutputKeys;
extern const SettingsTable<EnableInput> kEnableInputKeys;

}  // namespace tankrig
