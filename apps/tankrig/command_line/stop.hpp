// Ctrl-C, Ctrl-Z, any kill that can be caught, a closed terminal and the stop key as a request to stop.
#pragma once

#include <atomic>
#include <functional>
#include <stdexcept>

#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "rig/platform/sleep_inhibitor.hpp"
#include "rig/safety/emergency.hpp"
#include "rig/safety/stop_key.hpp"

namespace tankrig::app {

/// A request to stop was seen while there was nothing yet to make safe or to keep: main says so, kPartial.
class StoppedEarly : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// While it lives, every signal that would end or suspend the program sets requested(). Left are: those of a crash
/// (EmergencyStop), SIGPIPE and SIGXFSZ (ignored: the write fails), and those nobody can catch: SIGKILL, SIGSTOP, and
/// 32 and 33, which the C library keeps to itself. The third signal, of whatever kind, ends the program at once: laser
/// off and arm at rest by EmergencyStop where devices are in use, then death of that signal. A key that is held on the
/// terminal counts once, to the end of the program: its exit code is the stop's. SIGTTIN and SIGTTOU do not count: a
/// terminal sends them by itself. Several at a time are as one.
/// Threads: one.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  static const std::atomic<bool>& requested();
  /// Whether a stop is asked for after this call, be it once more.
  static std::function<bool()> from_now_on();
};

/// While laser or arm may do something: the stop key of the terminal, which is told on the screen, the last resort of a
/// program that dies, and, in real time, a machine that is not suspended; where that cannot be kept off, it is told.
/// One at a time.
class RigStops {
 public:
  /// `hold_to_run`: a key must be held for anything to move.
  RigStops(Backend& backend, Progress& progress, bool hold_to_run = false);
  /// Hold to run: waits until a key is held; false if a stop is asked for first. At once where no key need be held, or
  /// there is no terminal.
  bool key_is_held(Clock& clock) const;

 private:
  const bool hold_to_run_;
  EmergencyStop emergency_;
  StopKey key_;
  std::optional<SleepInhibitor> inhibitor_;
};

}  // namespace tankrig::app
