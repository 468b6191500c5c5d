// The watchdog box behind its serial line, with its two contactors and somebody at its button.
#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "core/config_node.hpp"
#include "drivers/watchdog/box_frames.hpp"
#include "drivers/watchdog/watchdog_settings.hpp"
#include "sim_backends/wire/box_logic.hpp"
#include "sim_backends/wire/pty_server.hpp"

namespace tankrig::sim {

struct BoxEmulatorSettings {
  std::filesystem::path name;                             ///< of the line
  Duration drop_out = std::chrono::milliseconds(20);      ///< of a contactor
  Duration reset_after = std::chrono::milliseconds(200);  ///< somebody presses its button so long after it can be reset
  bool nobody_there = false;                              ///< nobody does
};

/// The rig file's `emulation: box:`.
extern const SettingsTable<BoxEmulatorSettings> kBoxEmulatorKeys;

/// Takes the program's frames, replies to each and every 20 ms besides.
/// Threads: any; owns one.
class BoxEmulator {
 public:
  /// `contactors(closed)` is called in its thread whenever both contactors close, or either opens.
  /// Errors: InputError, as Pty.
  BoxEmulator(BoxEmulatorSettings settings, std::function<void(bool closed)> contactors);

  /// The contactors' contacts weld where they are.
  void set_welded(bool welded) noexcept { welded_ = welded; }
  /// Somebody presses the stop, or releases it.
  void press_stop(bool pressed) noexcept { stop_pressed_ = pressed; }
  void unplug() { server_.unplug(); }
  void plug() { server_.plug(); }

  bool closed() const noexcept { return closed_; }
  bool stuck() const noexcept { return stuck_; }
  std::uint64_t edges() const noexcept { return edges_; }
  /// When the newest good frame came; when the contactors last opened.
  std::optional<Stamp> last_edge() const noexcept { return stamp_of(last_edge_ns_); }
  std::optional<Stamp> opened() const noexcept { return stamp_of(opened_ns_); }

 private:
  void receive(std::span<const std::uint8_t> bytes);
  Duration tick();
  void press_button(Stamp now);
  void move_contactors(Stamp now);
  void reply();
  static std::optional<Stamp> stamp_of(const std::atomic<std::int64_t>& ns) noexcept {
    return ns == 0 ? std::nullopt : std::optional(Stamp{ns});
  }

  const BoxEmulatorSettings settings_;
  const std::function<void(bool)> contactors_;
  std::atomic<bool> welded_{false}, closed_{false}, stuck_{false}, stop_pressed_{false};
  std::atomic<std::uint64_t> edges_{0};
  std::atomic<std::int64_t> last_edge_ns_{0}, opened_ns_{0};
  // Its thread's.
  bool real_time_ = false;
  BoxReader reader_{kBeatLead};
  BoxLogic logic_;
  std::optional<std::uint8_t> beat_;
  std::optional<Stamp> ready_since_, dropping_since_;
  Stamp reply_at_{};
  PtyServer server_;  // last: its thread uses all of the above
};

}  // namespace tankrig::sim
