#include "drivers/watchdog/watchdog_box.hpp"

#include <algorithm>

#include "core/input_error.hpp"
#include "core/thread_priority.hpp"
#include "drivers/device_path.hpp"

namespace tankrig {
namespace {

constexpr int kPriority = 79;  // just below the cycle's, whose steps it passes on
constexpr Duration kFirstWord = std::chrono::seconds(1);

}  // namespace

WatchdogBox::WatchdogBox(const WatchdogSettings& settings, const std::filesystem::path& runtime, const Clock& clock)
    : settings_(settings), clock_(clock), lines_(open_watchdog_lines(settings, runtime)) {
  if (lines_.enable) require_answer(runtime);
  thread_ = std::thread([this] { run(); });
}

WatchdogBox::~WatchdogBox() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void WatchdogBox::require_answer(const std::filesystem::path& runtime) {
  std::unique_lock lock(mutex_);
  for (const Stamp end = clock_.now() + kFirstWord; clock_.now() < end && !heard_;) {
    look();
    if (!heard_) wake_.wait_for(lock, std::chrono::milliseconds(5));
  }
  if (heard_) return;
  const EnableInput& input = settings_.enable;
  throw InputError("safety: enable_input: the watchdog box on " +
                   device_path(input.device.empty() ? settings_.heartbeat.device : input.device, runtime) +
                   " says nothing, expected a reply within a second: switch it on, check its cable, or take "
                   "enable_input out of the rig file");
}

void WatchdogBox::look() noexcept {
  const auto said = lines_.enable->read();
  if (!said.ok()) failures_.fetch_add(1, std::memory_order_relaxed);
  if (!said.ok() || !said.value()) return;
  heard_ = true;
  const bool enabled = *said.value();
  if (was_enabled_ && !enabled) openings_.fetch_add(1, std::memory_order_relaxed);
  was_enabled_ = enabled;
  enabled_ns_.store(enabled ? clock_.now().ns : std::numeric_limits<std::int64_t>::min() / 2,
                    std::memory_order_relaxed);
}

void WatchdogBox::run() {
  set_fifo("watchdog-box", kPriority);
  std::uint64_t seen = steps_.load(std::memory_order_acquire);
  std::unique_lock lock(mutex_);
  Stamp next = clock_.now();
  while (!ends_) {
    if (const std::uint64_t steps = steps_.load(std::memory_order_acquire); lines_.heartbeat && steps != seen) {
      seen = steps;
      (lines_.heartbeat->edge().ok() ? edges_ : failures_).fetch_add(1, std::memory_order_relaxed);
    }
    if (lines_.enable) look();
    next = std::max(next + settings_.heartbeat.half_period, clock_.now());
    wake_.wait_for(lock, next - clock_.now(), [this] { return ends_; });
  }
}

Statistics WatchdogBox::statistics() const {
  return {{"edges", static_cast<double>(edges_.load())},
          {"failures", static_cast<double>(failures_.load())},
          {"openings", static_cast<double>(openings_.load())}};
}

}  // namespace tankrig
