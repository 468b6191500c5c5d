// A box beside the program that takes arm and laser their supply away when completed safety steps stop coming.
#pragma once

#include <atomic>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>

#include "core/clock.hpp"
#include "drivers/output_right.hpp"
#include "drivers/statistics.hpp"
#include "drivers/watchdog/watchdog_lines.hpp"

namespace tankrig {

/// A thread of its own gives the heartbeat its next edge where a step was completed since the edge before, and reads the
/// box's enabled contact: an adapter on a USB bus may hold either up. So a cycle that hangs makes no edge, nor does a
/// thread that hangs, and what it last read is soon too old.
/// Threads: completed() and enabled() the cycle's; the rest one other.
/// RT: completed(), enabled().
class WatchdogBox {
 public:
  /// An enabled contact that was last read longer ago is open.
  static constexpr Duration kFresh = std::chrono::milliseconds(150);

  /// `clock`: real, and outlives it. An enable input that says nothing within a second is a box that is not there.
  /// Errors: InputError that says what to do.
  WatchdogBox(const WatchdogSettings& settings, const std::filesystem::path& runtime, const Clock& clock);
  ~WatchdogBox();
  WatchdogBox(const WatchdogBox&) = delete;
  WatchdogBox& operator=(const WatchdogBox&) = delete;

  /// A safety step was decided, and laser and arm took what it decided. By its right, the rig's guard alone says so.
  void completed(const OutputRight& /*right*/) noexcept { steps_.fetch_add(1, std::memory_order_release); }
  /// The box feeds arm and laser; always where the rig reads no enable input.
  bool enabled(Stamp now) const noexcept {
    return !lines_.enable || now.ns - enabled_ns_.load(std::memory_order_relaxed) <= kFresh.count();
  }

  bool reads_enable() const noexcept { return lines_.enable != nullptr; }
  Duration enable_wait() const noexcept { return settings_.enable.wait; }
  Statistics statistics() const;

 private:
  void require_answer(const std::filesystem::path& runtime);
  void look() noexcept;
  void run();

  const WatchdogSettings settings_;
  const Clock& clock_;
  const WatchdogLines lines_;
  std::atomic<std::uint64_t> steps_{0};
  std::atomic<std::int64_t> enabled_ns_{std::numeric_limits<std::int64_t>::min() / 2};  // when it was last read closed
  std::atomic<bool> heard_{false};
  std::atomic<std::uint64_t> edges_{0}, failures_{0}, openings_{0};
  std::mutex mutex_;  // guards ends_
  std::condition_variable wake_;
  bool ends_ = false;
  bool was_enabled_ = false;  // the thread's
  std::thread thread_;        // last: it uses all of the above
};

}  // namespace tankrig
