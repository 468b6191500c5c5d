// A lux meter in the emulated tank, as its serial line sees it.
#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "core/config_node.hpp"
#include "sim_backends/wire/lux_frames.hpp"
#include "sim_backends/wire/pty_server.hpp"

namespace tankrig::sim {

enum class LuxMeterKind : std::uint8_t { kPce174, kT10a };

struct LuxEmulatorSettings {
  LuxMeterKind kind = LuxMeterKind::kPce174;
  std::filesystem::path name;  ///< of the line
  LuxUnit unit = LuxUnit::kLux;
  int head = 0;                                           ///< T-10A only
  Duration answer_delay = std::chrono::milliseconds{35};  ///< 32 bytes at 9600 baud take 33 ms
};

/// The rig file's `emulation: lux_meter:`.
extern const SettingsTable<LuxEmulatorSettings> kLuxEmulatorKeys;

/// The meter for a rig file's `lux_meter`, with the behaviour from `emulation`, if any.
/// Errors: InputError.
LuxEmulatorSettings lux_emulator_settings_from(const ConfigNode& lux_meter, const ConfigNode* emulation,
                                               const std::filesystem::path& runtime);

/// Possible faults of the meter.
enum class LuxFault : std::uint8_t {
  kNone,
  kSilent,
  kGarbage,        ///< noise before every answer
  kNonsense,       ///< noise only
  kTruncated,      ///< the last byte is missing
  kWrongChecksum,  ///< of the T-10A; the PCE-174 has none, there the value and its copy differ
};

/// The PCE-174 answers its live request, and the keys HOLD and UNITS. The T-10A answers nothing before command 54, and
/// forgets that command when it is unplugged.
/// Threads: any; owns one, which calls `illuminance`.
class LuxEmulator {
 public:
  /// `illuminance` [lux], e.g. TankWorld's.
  /// Errors: InputError, as Pty.
  LuxEmulator(LuxEmulatorSettings settings, std::function<double()> illuminance);

  void set_fault(LuxFault fault) noexcept { fault_ = fault; }
  void set_answer_delay(Duration delay) noexcept { answer_delay_ns_ = delay.count(); }
  void set_hold(bool hold) noexcept { hold_ = hold; }
  void set_low_battery(bool low) noexcept { low_battery_ = low; }
  void unplug();
  void plug() { server_.plug(); }

 private:
  void receive(std::span<const std::uint8_t> bytes);
  bool take_pce174();
  bool take_t10a();
  void answer(std::span<const std::uint8_t> frame);
  MeterState state() const;

  LuxEmulatorSettings settings_;
  std::function<double()> illuminance_;
  std::atomic<LuxFault> fault_{LuxFault::kNone};
  std::atomic<std::int64_t> answer_delay_ns_;
  std::atomic<bool> hold_{false}, low_battery_{false}, foot_candle_, pc_mode_{false};
  std::vector<std::uint8_t> pending_;
  PtyServer server_;  // last: its thread uses all of the above
};

}  // namespace tankrig::sim
