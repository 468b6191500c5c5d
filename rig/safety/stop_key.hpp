// The stop key: a key on the terminal that ends a scan at once.
#pragma once

#include <atomic>
#include <optional>
#include <thread>

#include "core/time.hpp"

namespace tankrig {

/// A key that is held repeats: first after a pause, then quickly. Slower than this, it has been let go.
struct HeldKey {
  Duration first = std::chrono::milliseconds{1000}, next = std::chrono::milliseconds{400};
};

/// While it lives, space, Enter, q, Esc or Ctrl-D on the terminal set the flag; so does the loss of the terminal. Keys
/// are read one by one, without echo; signals (Ctrl-C) keep their meaning. The destructor restores the terminal's mode;
/// restore() does so on exits without destructors. One at a time.
/// Hold to run: q, Esc and Ctrl-D set the flag; every other key holds, and the flag is set once it is let go.
/// Threads: its own reads.
class StopKey {
 public:
  /// `stop` outlives it. Does nothing if `descriptor` is no terminal, or not this program's to read.
  StopKey(int descriptor, std::atomic<bool>& stop, const std::optional<HeldKey>& hold_to_run = {});
  ~StopKey();
  StopKey(const StopKey&) = delete;
  StopKey& operator=(const StopKey&) = delete;

  bool active() const noexcept { return thread_.joinable(); }
  /// Hold to run: a key has been pressed.
  /// Threads: any.
  bool held() const noexcept { return held_; }

  /// Gives the terminal its own mode back.
  /// Threads: any, also signal handlers.
  static void restore() noexcept;

 private:
  void run() noexcept;

  const int descriptor_;
  std::atomic<bool>& stop_;
  const std::optional<HeldKey> hold_to_run_;
  std::atomic<bool> held_{false};
  int wake_ = -1;  // eventfd
  std::thread thread_;
};

}  // namespace tankrig
