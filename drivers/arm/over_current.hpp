// Whether the arm's supply current has been too high for too long.
#pragma once

#include <optional>

#include "core/time.hpp"

namespace tankrig {

/// Source of the defaults: the laboratory's public controller stops for good when the arm draws more than 2 A for 1.5
/// s.
struct OverCurrentLimit {
  double amperes = 2;  ///< of the whole arm
  Duration duration = std::chrono::milliseconds(1500);
};

/// Threads: one.
/// RT: safe.
class OverCurrentWatch {
 public:
  /// Whether the current is over `limit` now, and has been at every reading of the last `limit.duration`.
  bool step(const OverCurrentLimit& limit, Stamp stamp, double amperes) noexcept {
    if (!(amperes > limit.amperes)) {
      since_.reset();
      return false;
    }
    if (!since_) since_ = stamp;
    return stamp - *since_ >= limit.duration;
  }

 private:
  std::optional<Stamp> since_;
};

}  // namespace tankrig
