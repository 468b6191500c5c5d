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
constexpr int kClearOfPowerUp = kPowerUpTicks + 2 * ZeroProof::kSettled;
constexpr std::array<int, kJoints> kRest{};

/// One homing run: the arm exchanged with every few milliseconds, and the reasons to end it.
class Run {
 public:
  Run(Arm5e& arm, Clock& clock, const std::atomic<bool>* stop, const HomingCallback& progress,
      const HomingStep& stepped)
      : arm_(arm), clock_(clock), stop_(stop), progress_(progress), stepped_(stepped) {}

  /// Sends the demand and waits a step; the newest readings, or why it cannot go on.
  Result<bool> step(const std::array<int, kJoints>& ticks_per_s) {
    if (stop_ && *stop_) return Error{ErrorCode::kRefused, 0, clock_.now(), "arm: homing interrupted"};
    const Status written = arm_.write_ticks(ticks_per_s);
    if (!written.ok()) return written.error();
    clock_.sleep_until(clock_.now() + kStep);
    const auto state = arm_.try_read();
    if (!state.ok()) return state.error();
    if (stepped_)
      if (const Status goes_on = stepped_(clock_.now()); !goes_on.ok()) return goes_on.error();
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

  /// Until the axis stands; one that is driven, with more current than its stop current. `direction` 0: not driven.
  /// One reading will not do: a false one may lie where the joint could be.
  Result<HomedAxis> drive(Joint joint, int direction) {
    const HomingSettings& homing = arm_.settings().homing;
    std::array<int, kJoints> demand{};
    demand[joint] = direction * homing.speed_ticks_per_s;
    const Stamp begin = clock_.now();
    Stamp read{}, since{};
    std::uint16_t place = 0;
    int agreeing = 0;  // readings in a row
    while (clock_.now() - begin < homing.longest) {
      const auto news = step(demand);
      if (!news.ok()) return news.error();
      show(joint, direction == 0 ? HomingProgress::Phase::kPausing : HomingProgress::Phase::kDriving);
      const ArmReadings& now = arm_.readings();
      if (!news.value() || arm_.encoder(joint).when() == read) continue;
      read = arm_.encoder(joint).when();
      const std::uint16_t raw = arm_.encoder(joint).raw();
      const bool moved =
          std::abs(static_cast<std::int16_t>(static_cast<std::uint16_t>(raw - place))) > kStandstillTicks;
      if (agreeing == 0 || moved || (direction != 0 && now.current_a <= homing.stop_current_a)) {
        place = raw;
        since = read;
        agreeing = 1;
        continue;
      }
      if (++agreeing < arm_.settings().encoder.persists_samples || read - since < kStandstill) continue;
      return HomedAxis{raw, 0, 0, now.current_a};
    }
    return Error{ErrorCode::kTimeout, 0, clock_.now(),
                 direction == 0 ? "arm: does not come to rest" : "arm: no stop found in its time"};
  }

  /// A stop at which the joint stood at power-up proves nothing to the next program (ZeroProof): a little out of it.
  Status leave_power_up(Joint joint, int direction) {
    std::array<int, kJoints> demand{};
    demand[joint] = -direction * arm_.settings().homing.speed_ticks_per_s;
    const Stamp begin = clock_.now();
    while (std::abs(static_cast<std::int16_t>(arm_.encoder(joint).raw())) < kClearOfPowerUp) {
      const auto news = step(demand);
      if (!news.ok()) return news.error();
      if (clock_.now() - begin > arm_.settings().homing.longest)
        return Error{ErrorCode::kTimeout, 0, clock_.now(), "arm: does not leave its stop"};
    }
    return {};
  }

  void show(Joint joint, HomingProgress::Phase phase) {
    const Stamp now = clock_.now();
    if (!progress_ || (phase != HomingProgress::Phase::kDone && now - shown_ < kShown)) return;
    shown_ = now;
    progress_({joint, phase, arm_.encoder(joint).raw(), arm_.readings().current_a});
  }

 private:
  Arm5e& arm_;
  Clock& clock_;
  const std::atomic<bool>* stop_;
  const HomingCallback& progress_;
  const HomingStep& stepped_;
  Stamp shown_{};
};

/// The joint's limit on the side where its actuator has the fewest, or the most, ticks.
double angle_at_stop(const ArmModel& model, Joint joint, int direction) {
  const JointLimit& limit = model.limits[joint];
  const Actuator& actuator = model.actuators[joint];
  const bool lower = (actuator.ticks(limit.lower) < actuator.ticks(limit.upper)) == (direction < 0);
  return lower ? limit.lower : limit.upper;
}

int way_to_stop(HomeDirection direction) {
  if (direction == HomeDirection::kNone) return 0;
  return direction == HomeDirection::kNegative ? -1 : 1;
}

HomedAxis with_zero(HomedAxis axis, const Actuator& actuator) {
  axis.raw_at_zero = static_cast<std::uint16_t>(axis.raw_at_stop - std::lround(actuator.ticks(axis.angle_at_stop)));
  return axis;
}

Result<HomedAxis> home_axis(Run& run, Arm5e& arm, Joint joint) {
  const HomingSettings& homing = arm.settings().homing;
  const int direction = way_to_stop(homing.direction[joint]);
  const auto found = run.drive(joint, direction);
  if (!found.ok()) return found.error();
  HomedAxis axis = found.value();
  if (direction == 0) {
    axis.angle_at_stop = homing.rest_angle[joint];
  } else {
    axis.angle_at_stop = angle_at_stop(arm.model(), joint, direction);
    const Status paused = run.pause(joint, homing.pause);
    if (!paused.ok()) return paused.error();
    const Status left = run.leave_power_up(joint, direction);
    if (!left.ok()) return left.error();
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

HomingResult home_axes(Arm5e& arm, Clock& clock, const std::atomic<bool>* stop, const HomingCallback& progress,
                       const HomingStep& stepped) {
  const struct Rest {
    Arm5e& arm;
    ~Rest() { (void)arm.stop(); }
  } whatever_ends_it{arm};
  Run run(arm, clock, stop, progress, stepped);
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
