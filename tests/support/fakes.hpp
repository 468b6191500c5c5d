// Hand-driven arm and laser that log what the cycle does to them, in order.
#pragma once

#include <array>
#include <string_view>

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig::testing_support {

/// The order of calls, without allocation.
struct CallLog {
  std::array<std::string_view, 65536> calls{};
  std::size_t count = 0;

  void add(std::string_view call) noexcept {
    if (count < calls.size()) calls[count++] = call;
  }
  void clear() noexcept { count = 0; }
  /// Position of the first such call, or count.
  std::size_t first(std::string_view call) const {
    for (std::size_t i = 0; i < count; ++i)
      if (calls[i] == call) return i;
    return count;
  }
};

/// Goes where it is told to, at once and exactly.
class FakeArm final : public Arm {
 public:
  FakeArm(CallLog& log, const JointVector& q) : log_(log), q_(q) {}

  Result<std::optional<JointState>> try_read() noexcept override {
    if (fail_read) return Error{ErrorCode::kDisconnected, 0, now, "arm: read joints"};
    if (silent) return std::optional<JointState>{};
    JointState s;
    s.stamp = now;
    s.q = q_;
    s.velocity = velocity_;
    return std::optional<JointState>(s);
  }
  Result<JointVector> write_velocity(const OutputRight&, const JointVector& v) noexcept override {
    log_.add("velocity");
    if (fail_write) return Error{ErrorCode::kIo, 5, now, "arm: write set-points"};
    velocity_ = v;
    return v;
  }
  Status stop() noexcept override {
    log_.add("stop");
    if (fail_stop) return Error{ErrorCode::kIo, 5, now, "arm: stop"};
    velocity_.setZero();
    return {};
  }
  Duration exchange_period() const noexcept override { return std::chrono::milliseconds{5}; }

  void advance(Stamp to) {
    if (!stuck) q_ += velocity_ * seconds(to - now);
    now = to;
  }
  const JointVector& velocity() const { return velocity_; }

  Stamp now{};
  bool fail_read = false, fail_write = false, fail_stop = false, silent = false, stuck = false;

 private:
  CallLog& log_;
  JointVector q_;
  JointVector velocity_ = JointVector::Zero();
};

class FakeLaser final : public Laser {
 public:
  explicit FakeLaser(CallLog& log) : log_(log) {}

  Status set(bool on) noexcept override {
    log_.add(on ? "laser on" : "laser off");
    if (fail && on) return Error{ErrorCode::kTimeout, 0, {}, "laser: relay"};
    if (fail_off && !on) return Error{ErrorCode::kTimeout, 0, {}, "laser: relay"};
    on_ = on || (on_ && stuck_on);
    return {};
  }
  Result<LaserState> state() noexcept override {
    if (fail_state) return Error{ErrorCode::kDisconnected, 0, {}, "laser: state"};
    return LaserState{on_, on_, on_ && !dead, {}, loop_closed};
  }
  Duration warm_up() const noexcept override { return Duration{0}; }

  bool on() const { return on_; }
  bool fail = false, fail_off = false, fail_state = false, stuck_on = false, dead = false;
  std::optional<bool> loop_closed{};  ///< nothing: it reads none

 private:
  CallLog& log_;
  bool on_ = false;
};

}  // namespace tankrig::testing_support
