// The stop key: a key on the terminal that ends a scan at once.
#pragma once

#include <atomic>
#include <thread>

namespace tankrig {

/// While it lives, space, Enter, q, Esc or Ctrl-D on the terminal set the flag, and so does a terminal that goes away.
/// It reads keys one by one, without echo; signals stay what they are (Ctrl-C). The terminal's own mode comes back at
/// the end of its life, and by restore() on ways out that run no destructor. One at a time.
/// Threads: a thread of its own reads.
class StopKey {
 public:
  /// `stop` outlives it. Does nothing where `descriptor` is no terminal, or not this program's to read from.
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
