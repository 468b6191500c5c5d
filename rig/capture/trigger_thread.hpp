// The device thread that triggers one camera: a bounded queue in, what became of the triggers out.
#pragma once

#include <atomic>
#include <thread>

#include "core/clock.hpp"
#include "core/heartbeat.hpp"
#include "core/spsc_ring.hpp"
#include "drivers/camera/camera.hpp"
#include "rig/capture/trigger_schedule.hpp"

namespace tankrig {

/// A trigger that was given.
struct FiredTrigger {
  TriggerRequest request;
  Stamp fired{};  ///< when Camera::trigger() was called
  bool accepted = false;
  Error error{};  ///< of one that was not
};

/// Calls Camera::trigger() when a request says so. In real time a thread of its own sleeps until then, so a camera that
/// takes its time holds up nobody; under a virtual clock fire_due() does the same in the caller's turn.
/// Threads: request() in the cycle's, everything else in one other.
/// RT: request is safe.
class TriggerThread {
 public:
  static constexpr std::size_t kWaiting = 16;  ///< requests; a camera that answers has none or one

  TriggerThread(Camera& camera, Clock& clock);
  ~TriggerThread();
  TriggerThread(const TriggerThread&) = delete;
  TriggerThread& operator=(const TriggerThread&) = delete;

  /// False if too many wait: it is dropped, and counted by the caller.
  bool request(const TriggerRequest& request) noexcept;

  /// Starts the thread where time is real.
  void begin();
  /// Waits for the trigger that is being given; none is given after it. Not for a dead thread.
  void end();
  /// Under a virtual clock: when the next trigger is due, and giving it; the clock moves on to it.
  std::optional<Stamp> due() noexcept;
  void fire_due() noexcept;
  /// Next of what was fired.
  bool try_pop(FiredTrigger& fired) noexcept { return fired_.try_pop(fired); }
  /// The thread has ended though nobody asked it to, or a trigger does not come back from the camera.
  bool dead() const noexcept { return life_.missing(clock_.now()); }

 private:
  void run();
  void fire(const TriggerRequest& request);

  Camera& camera_;
  Clock& clock_;
  SpscRing<TriggerRequest> requests_;
  SpscRing<FiredTrigger> fired_;
  const int news_;  // eventfd: a wake-up that never waits
  std::atomic<bool> ending_{false};
  Heartbeat life_;
  std::optional<TriggerRequest> next_;  // of due()
  std::thread thread_;
};

}  // namespace tankrig
