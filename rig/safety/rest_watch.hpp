// Whether the arm is measured at rest: for light with the arm held still, and for the end of a scan.
#pragma once

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
      slow_ = at_rest_ = false;
      return;
    }
    if (!slow_) since_ = joints.stamp;
    slow_ = true;
    at_rest_ = joints.stamp - since_ >= kWindow;
  }

  bool at_rest() const noexcept { return at_rest_; }

 private:
  double velocity_;
  bool slow_ = false, at_rest_ = false;
  Stamp since_{};  ///< while slow_
};

}  // namespace tankrig
