// The box that switches the laser's supply, behind its serial line.
#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "core/config_node.hpp"
#include "drivers/laser/relay_protocol.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/wire/pty_server.hpp"

namespace tankrig::sim {

struct RelayEmulatorSettings {
  std::filesystem::path name;  ///< of the line
  RelayProtocol protocol{};
  Duration watchdog = std::chrono::seconds{1};           ///< opens by itself if no on came for longer; 0: never
  Duration answer_delay = std::chrono::milliseconds{2};  ///< a byte each way at 9600 baud
};

/// The rig file's `emulation: laser:`.
extern const SettingsTable<RelayEmulatorSettings> kRelayEmulatorKeys;

/// The box for a rig file's `laser`, with the behaviour from `emulation`, if any.
/// Errors: InputError.
RelayEmulatorSettings relay_emulator_settings_from(const ConfigNode& laser, const ConfigNode* emulation,
                                                   const std::filesystem::path& runtime);

/// Possible faults of the box.
enum class RelayFault : std::uint8_t {
  kNone,
  kSilent,     ///< switches, but never answers
  kDead,       ///< takes the bytes, does nothing
  kWrongEcho,  ///< switches, and answers another byte
  kGarbage,    ///< as kNone, with noise before every answer
};

/// Drives a MockLaser, whose power_at() is what emulated cameras see: on while both the relay and the interlock's loop,
/// wired in series, are closed.
/// Threads: any; owns one, and the MockLaser's set() and faults while it lives.
class RelayEmulator {
 public:
  /// Errors: InputError, as Pty.
  RelayEmulator(RelayEmulatorSettings settings, MockLaser& laser);

  void set_fault(RelayFault fault) noexcept { fault_ = fault; }
  void set_answer_delay(Duration delay) noexcept { answer_delay_ns_ = delay.count(); }
  /// The contact sticks while it is closed.
  void set_welded(bool welded) noexcept { welded_ = welded; }
  /// The supply before the relay's contact comes or goes.
  void set_fed(bool fed) noexcept;
  /// Opens the lid.
  void set_interlock_closed(bool closed) noexcept;
  void unplug() { server_.unplug(); }
  void plug() { server_.plug(); }

  bool relay_closed() const noexcept { return closed_; }
  std::uint64_t watchdog_openings() const noexcept { return watchdog_openings_; }
  /// When an on byte first came; since when the newest command is off; when the contact last opened.
  std::optional<Stamp> first_on() const noexcept { return stamp_of(first_on_ns_); }
  std::optional<Stamp> off_since() const noexcept { return stamp_of(off_since_ns_); }
  std::optional<Stamp> opened() const noexcept { return stamp_of(opened_ns_); }
  /// Every byte since the last call.
  std::vector<std::uint8_t> take_received();

 private:
  void receive(std::span<const std::uint8_t> bytes);
  Duration tick();
  void switch_relay(bool on);
  void answer(std::uint8_t byte);
  static std::optional<Stamp> stamp_of(const std::atomic<std::int64_t>& ns) noexcept {
    return ns == 0 ? std::nullopt : std::optional(Stamp{ns});
  }

  RelayEmulatorSettings settings_;
  MockLaser& laser_;
  std::atomic<RelayFault> fault_{RelayFault::kNone};
  std::atomic<std::int64_t> answer_delay_ns_;
  std::atomic<bool> welded_{false}, interlock_closed_{true}, closed_{false}, fed_{true};
  std::atomic<std::uint64_t> watchdog_openings_{0};
  std::atomic<std::int64_t> first_on_ns_{0}, off_since_ns_{0}, opened_ns_{0};
  std::mutex mutex_;  // guards received_
  std::vector<std::uint8_t> received_;
  Stamp last_on_{};
  PtyServer server_;  // last: its thread uses all of the above
};

}  // namespace tankrig::sim
