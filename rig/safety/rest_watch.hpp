// Whether the arm is measured at rest: for light with the arm held still, and for the end of a scan.
#pragma once

#include <optional>

#include "drivers/arm/arm.hpp"

namespace tankrig {

/// At rest: every joint slower than `velocity` [rad/s] in an unbroken run of samples of kWindow or longer.
/// Threads: one.
/// RT: safe.
class RestWatch {
 public:
  static constexpr Duration kWindow = std::chrono::milliseconds{100};

  explicit RestWatch(double velocity) : velocity_(velocity) {}

  /// Samples in order of their stamps. A velocity that is not a number is not rest.
  void add(const JointState& joints) noexcept {
    if (!(joints.velocity.cwiseAbs().array() < velocity_).all()) {
      since_.reset();
      at_rest_ = false;
      return;
    }
    if (!since_) since_ = joints.stamp;
    at_rest_ = joints.stamp - *since_ >= kWindow;
  }

  bool at_rest() const noexcept { return at_rest_; }

 private:
  double velocity_;
  std::optional<Stamp> since_;
  bool at_rest_ = false;
};

}  // namespace tankrig
