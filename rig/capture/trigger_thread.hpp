// The device thread that triggers one camera: a bounded queue in, the fate of each trigger out.
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
  Error error{};  ///< of a trigger that failed
};

/// Calls Camera::trigger() when a request is due. In real time its own thread sleeps until then, so a slow camera holds
/// up nobody; under a virtual clock fire_due() does the same in the caller's turn.
/// Threads: request() in the cycle's, everything else in one other.
/// RT: request is safe.
class TriggerThread {
 public:
  static constexpr std::size_t kWaiting = 16;  ///< requests; a camera that answers has at most one

  TriggerThread(Camera& camera, Clock& clock);
  ~TriggerThread();
  TriggerThread(const TriggerThread&) = delete;
  TriggerThread& operator=(const TriggerThread&) = delete;

  /// False if too many wait: the request is dropped, and the caller counts it.
  bool request(const TriggerRequest& request) noexcept;

  /// Starts the thread, in real time only.
  void begin();
  /// Waits for the trigger in progress; none follows. Does not wait for a dead thread.
  void end();
  /// Under a virtual clock: when the next trigger is due; fires it and moves the clock on.
  std::optional<Stamp> due() noexcept;
  void fire_due() noexcept;
  /// The next fired trigger.
  bool try_pop(FiredTrigger& fired) noexcept { return fired_.try_pop(fired); }
  /// The thread has ended unasked, or hangs in the camera's trigger().
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
