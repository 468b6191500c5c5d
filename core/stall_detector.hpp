// For how long something periodic has stood still, as far as its watcher was there to see.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/time.hpp"

namespace tankrig {

/// A watcher that was away or suspended saw nothing meanwhile. So one look adds at most `longest_look`, however long
/// ago the last look was.
/// Threads: the watcher's.
/// RT: safe.
class StallDetector {
 public:
  explicit StallDetector(Duration longest_look, Stamp from = {}) noexcept
      : longest_look_(longest_look), looked_(from) {}

  void restart(Stamp from) noexcept { *this = StallDetector(longest_look_, from); }

  /// `rounds`: how many rounds it has made, from 0 at the start of the watch.
  void look(Stamp now, std::uint64_t rounds) noexcept {
    silent_ = rounds != rounds_ ? Duration{0} : silent_ + std::min(now - looked_, longest_look_);
    rounds_ = rounds;
    looked_ = now;
  }

  /// At the last look.
  Duration stalled_for() const noexcept { return silent_; }

 private:
  Duration longest_look_;
  Stamp looked_;
  std::uint64_t rounds_ = 0;
  Duration silent_{};
};

}  // namespace tankrig
