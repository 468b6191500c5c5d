// The thread beside the cycle that watches the arm: how it runs, and whether it still does.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "core/clock.hpp"
#include "core/heartbeat.hpp"
#include "core/suspend_watch.hpp"

namespace tankrig {

/// Threads: its own; missing() any.
/// RT: missing().
class ArmKeeper {
 public:
  /// Called repeatedly; the argument tells whether the machine was suspended since the last call. A long call gives a
  /// heartbeat before it returns.
  using Round = std::function<void(bool suspended, Heartbeat& life)>;

  /// `clock`: real, and outlives it.
  ArmKeeper(const Clock& clock, Round round);
  ~ArmKeeper();
  ArmKeeper(const ArmKeeper&) = delete;
  ArmKeeper& operator=(const ArmKeeper&) = delete;

  /// Whether the thread is dead or stuck.
  bool missing(Stamp now) const noexcept { return life_.missing(now); }

 private:
  void run();

  const Clock& clock_;
  const Round round_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  Heartbeat life_;
  SuspendWatch suspend_watch_;
  std::thread thread_;
};

}  // namespace tankrig
