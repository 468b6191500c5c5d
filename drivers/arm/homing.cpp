#include "drivers/arm/homing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/utc.hpp"

namespace tankrig {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(5);
constexpr Duration kStandstill = std::chrono::milliseconds(100);  ///< at a stop for this long
constexpr Duration kFirstAnswer = std::chrono::seconds(2);
constexpr Duration kShown = std::chrono::milliseconds(100);
constexpr int kStandstillTicks = 3;
constexpr std::array<int, kJoints> kRest{};

/// One homing run: the arm exchanged with every few milliseconds, and the reasons to end it.
class Run {
 public:
  Run(Arm5e& arm, Clock& clock, const std::atomic<bool>* stop, const HomingCallback& progress)
      : arm_(arm), clock_(clock), stop_(stop), progress_(progress) {}

  /// Sends the demand and waits a step; the newest readings, or why it cannot go on.
  Result<bool> step(const std::array<int, kJoints>& ticks_per_s) {
    if (stop_ && *stop_) return Error{ErrorCode::kRefused, 0, clock_.now(), "arm: homing interrupted"};
    const Status written = arm_.write_ticks(ticks_per_s);
    if (!written.ok()) return written.error();
    clock_.sleep_until(clock_.now() + kStep);
    const auto state = arm_.try_read();
    if (!state.ok()) return state.error();
    return state.value().has_value();
  }

  Status first_answer() {
    for (const Stamp end = clock_.now() + kFirstAnswer; clock_.now() < end;) {
      const auto news = step(kRest);
      if (news.ok() && news.value()) return {};
      if (!news.ok() && news.error().code != ErrorCode::kTimeout) return news.error();
    }
    return Error{ErrorCode::kTimeout, 0, clock_.now(), "arm: silent"};
  }

  Status pause(Joint joint, Duration length) {
    for (const Stamp end = clock_.now() + length; clock_.now() < end;) {
      const auto news = step(kRest);
      if (!news.ok()) return news.error();
      show(joint, HomingProgress::Phase::kPausing);
    }
    return {};
  }

  /// Until the arm takes more than its stop current while the axis stands.
  Result<HomedAxis> drive(Joint joint, int direction) {
    const HomingSettings& homing = arm_.settings().homing;
    std::array<int, kJoints> demand{};
    demand[joint] = direction * homing.speed_ticks_per_s;
    const Stamp begin = clock_.now();
    Stamp standing = begin;
    std::uint16_t place = arm_.readings().raw[joint];
    while (clock_.now() - begin < homing.longest) {
      const auto news = step(demand);
      if (!news.ok()) return news.error();
      show(joint, HomingProgress::Phase::kDriving);
      if (!news.value()) continue;
      const ArmReadings& now = arm_.readings();
      const bool moved =
          std::abs(static_cast<std::int16_t>(static_cast<std::uint16_t>(now.raw[joint] - place))) > kStandstillTicks;
      if (moved || now.current_a <= homing.stop_current_a) {
        place = now.raw[joint];
        standing = now.stamp;
        continue;
      }
      if (now.stamp - standing < kStandstill) continue;
      return HomedAxis{now.raw[joint], 0, 0, now.current_a};
    }
    return Error{ErrorCode::kTimeout, 0, clock_.now(), "arm: no stop found in its time"};
  }

  void show(Joint joint, HomingProgress::Phase phase) {
    const Stamp now = clock_.now();
    if (!progress_ || (phase != HomingProgress::Phase::kDone && now - shown_ < kShown)) return;
    shown_ = now;
    progress_({joint, phase, arm_.readings().raw[joint], arm_.readings().current_a});
  }

 private:
  Arm5e& arm_;
  Clock& clock_;
  const std::atomic<bool>* stop_;
  const HomingCallback& progress_;
  Stamp shown_{};
};

/// The joint's limit on the side where its actuator has the fewest, or the most, ticks.
double angle_at_stop(const ArmModel& model, Joint joint, int direction) {
  const JointLimit& limit = model.limits[joint];
  const Actuator& actuator = model.actuators[joint];
  const bool lower = (actuator.ticks(limit.lower) < actuator.ticks(limit.upper)) == (direction < 0);
  return lower ? limit.lower : limit.upper;
}

HomedAxis with_zero(HomedAxis axis, const Actuator& actuator) {
  axis.raw_at_zero = static_cast<std::uint16_t>(axis.raw_at_stop - std::lround(actuator.ticks(axis.angle_at_stop)));
  return axis;
}

Result<HomedAxis> home_axis(Run& run, Arm5e& arm, Joint joint) {
  const HomingSettings& homing = arm.settings().homing;
  HomedAxis axis;
  if (homing.direction[joint] == HomeDirection::kNone) {
    axis.raw_at_stop = arm.readings().raw[joint];
    axis.angle_at_stop = homing.rest_angle[joint];
    axis.current_a = arm.readings().current_a;
  } else {
    const int direction = homing.direction[joint] == HomeDirection::kNegative ? -1 : 1;
    const auto found = run.drive(joint, direction);
    if (!found.ok()) return found.error();
    axis = found.value();
    axis.angle_at_stop = angle_at_stop(arm.model(), joint, direction);
    const Status paused = run.pause(joint, homing.pause);
    if (!paused.ok()) return paused.error();
  }
  run.show(joint, HomingProgress::Phase::kDone);
  return with_zero(axis, arm.model().actuators[joint]);
}

}  // namespace

ArmZero HomingResult::zero() const {
  ArmZero zero;
  for (std::size_t j = 0; j < kJoints; ++j)
    if (axes[j]) zero.raw[j] = axes[j]->raw_at_zero;
  zero.taken = utc_now();
  return zero;
}

std::string HomingResult::message() const {
  return error ? std::string(kJointNames[static_cast<std::size_t>(failed)]) + ": " + error->where : "homed";
}

HomingResult home_axes(Arm5e& arm, Clock& clock, const std::atomic<bool>* stop, const HomingCallback& progress) {
  const struct Rest {
    Arm5e& arm;
    ~Rest() { (void)arm.stop(); }
  } whatever_ends_it{arm};
  Run run(arm, clock, stop, progress);
  HomingResult result;
  const auto failed = [&](Joint joint, const Error& error) {
    result.error = error;
    result.failed = joint;
    return result;
  };
  arm.forget_zero();
  if (const Status ready = run.first_answer(); !ready.ok()) return failed(kSlew, ready.error());
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto joint = static_cast<Joint>(j);
    const auto axis = home_axis(run, arm, joint);
    if (!axis.ok()) return failed(joint, axis.error());
    result.axes[j] = axis.value();
  }
  if (const Status stopped = arm.stop(); !stopped.ok()) return failed(kJawOpening, stopped.error());
  arm.set_zero(result.zero());
  return result;
}

}  // namespace tankrig
