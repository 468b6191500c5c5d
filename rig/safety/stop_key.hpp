// The stop key: a key on the terminal that ends a scan at once.
#pragma once

#include <atomic>
#include <thread>

namespace tankrig {

/// While it lives, space, Enter, q, Esc or Ctrl-D on the terminal set the flag; so does the loss of the terminal. Keys
/// are read one by one, without echo; signals (Ctrl-C) keep their meaning. The destructor restores the terminal's mode;
/// restore() does so on exits without destructors. One at a time.
/// Threads: its own reads.
class StopKey {
 public:
  /// `stop` outlives it. Does nothing if `descriptor` is no terminal, or not this program's to read.
  StopKey(int descriptor, std::atomic<bool>& stop);
  ~StopKey();
  StopKey(const StopKey&) = delete;
  StopKey& operator=(const StopKey&) = delete;

  bool active() const noexcept { return thread_.joinable(); }

  /// Gives the terminal its own mode back.
  /// Threads: any, also signal handlers.
  static void restore() noexcept;

 private:
  void run() noexcept;

  const int descriptor_;
  std::atomic<bool>& stop_;
  int wake_ = -1;  // eventfd
  std::thread thread_;
};

}  // namespace tankrig
