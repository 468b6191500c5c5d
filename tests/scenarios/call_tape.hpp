// Who called which device when, in the order it happened: the measure of every reaction to a fault.
#pragma once

#include <mutex>
#include <optional>
#include <vector>

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig::scenarios {

enum class Call : std::uint8_t { kRead, kWrite, kStop, kLaserOn, kLaserOff, kLaserState, kCamera, kScan };

struct TapeEntry {
  Stamp when{};
  std::uint64_t cycle = 0;  ///< the executive reads the joints once in each
  Call call = Call::kRead;
  bool failed = false;
};

/// Threads: any; a mutex.
class CallTape {
 public:
  explicit CallTape(const Clock& clock) : clock_(clock) { entries_.reserve(1 << 16); }

  void add(Call call, bool failed) {
    const std::lock_guard lock(mutex_);
    if (call == Call::kRead) ++cycle_;
    if (call != Call::kRead || failed) entries_.push_back({clock_.now(), cycle_, call, failed});
  }
  std::vector<TapeEntry> entries() const {
    const std::lock_guard lock(mutex_);
    return entries_;
  }

 private:
  const Clock& clock_;
  mutable std::mutex mutex_;
  std::uint64_t cycle_ = 0;
  std::vector<TapeEntry> entries_;
};

class TapedArm final : public Arm {
 public:
  TapedArm(Arm& arm, CallTape& tape) : arm_(arm), tape_(tape) {}
  Result<std::optional<JointState>> try_read() noexcept override { return taped(Call::kRead, arm_.try_read()); }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return taped(Call::kWrite, arm_.write_velocity(right, v));
  }
  Status stop() noexcept override { return taped(Call::kStop, arm_.stop()); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

 private:
  template <class R>
  R taped(Call call, R result) {
    tape_.add(call, !result.ok());
    return result;
  }
  Arm& arm_;
  CallTape& tape_;
};

class TapedLaser final : public Laser {
 public:
  TapedLaser(Laser& laser, CallTape& tape) : laser_(laser), tape_(tape) {}
  Status set(bool on) noexcept override {
    const Status done = Laser::set(laser_, on);
    tape_.add(on ? Call::kLaserOn : Call::kLaserOff, !done.ok());
    return done;
  }
  Result<LaserState> state() noexcept override {
    const auto read = laser_.state();
    if (!read.ok()) tape_.add(Call::kLaserState, true);
    return read;
  }
  Duration warm_up() const noexcept override { return laser_.warm_up(); }

 private:
  Laser& laser_;
  CallTape& tape_;
};

class TapedCamera final : public Camera {
 public:
  TapedCamera(Camera& camera, CallTape& tape) : camera_(camera), tape_(tape) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override {
    const Status started = camera_.start();
    if (!started.ok()) tape_.add(Call::kCamera, true);
    return started;
  }
  Result<std::optional<Frame>> try_grab() override {
    auto read = camera_.try_grab();
    if (!read.ok()) tape_.add(Call::kCamera, true);
    return read;
  }
  std::optional<Stamp> next_frame_at() const override { return camera_.next_frame_at(); }
  void stop() noexcept override { camera_.stop(); }
  CameraCounters counters() const override { return camera_.counters(); }
  Status trigger() override { return camera_.trigger(); }

 private:
  Camera& camera_;
  CallTape& tape_;
};

/// From the moment a fault was noticed. Cycles are steps of the executive that were made.
struct Reaction {
  Stamp detected{}, laser_off{}, arm_stop{};
  std::uint64_t laser_cycles = 0;  ///< detection to the command off
  std::uint64_t arm_cycles = 0;    ///< from there to the command to rest
  bool laser_first = false;        ///< strictly before the arm
};

/// `noticed`: when the scan said so, where it was not a call that failed. Nothing if neither came after `from`, or if
/// one of the two commands never did.
std::optional<Reaction> reaction(const std::vector<TapeEntry>& tape, Stamp from, std::optional<Stamp> noticed);

}  // namespace tankrig::scenarios
