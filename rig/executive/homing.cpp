#include "rig/executive/homing.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "core/input_error.hpp"
#include "core/utc.hpp"
#include "rig/executive/homing_run.hpp"

namespace tankrig {
namespace {

constexpr int kClearOfPowerUp = kPowerUpTicks + 2 * ZeroProof::kSettled;

/// From `b` to `a`, across the wrap.
int ticks_between(std::uint16_t a, std::uint16_t b) noexcept {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(a - b));
}

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

/// Into the stop: fast, out of it, and slowly again.
Result<HomedAxis> find_stop(HomingRun& run, const Arm5e& arm, Joint joint, int direction) {
  const HomingSettings& homing = arm.settings().homing;
  const EncoderTrack& encoder = arm.encoder(joint);
  const auto fast = run.drive(joint, direction * homing.speed_ticks_per_s, HomingProgress::Phase::kDriving);
  if (!fast.ok()) return fast;
  const std::int32_t stop = encoder.ticks();
  const Status left = run.leave(joint, -direction * homing.slow_ticks_per_s,
                                [&] { return std::abs(encoder.ticks() - stop) >= homing.back_off_ticks; });
  if (!left.ok()) return left.error();
  const auto clear = run.drive(joint, 0, HomingProgress::Phase::kBackingOff);
  if (!clear.ok()) return clear;
  auto slow = run.drive(joint, direction * homing.slow_ticks_per_s, HomingProgress::Phase::kTouching);
  if (!slow.ok()) return slow;
  slow.value().fast_stop_ticks = ticks_between(fast.value().raw_at_stop, slow.value().raw_at_stop);
  if (std::abs(slow.value().fast_stop_ticks) <= homing.agreement_ticks) return slow;
  return Error{ErrorCode::kOutOfRange, 0, {}, "arm: its stop is not where it was found before: something soft?"};
}

Result<HomedAxis> home_axis(HomingRun& run, const Arm5e& arm, Joint joint) {
  const HomingSettings& homing = arm.settings().homing;
  const int direction = way_to_stop(homing.direction[joint]);
  auto found =
      direction == 0 ? run.drive(joint, 0, HomingProgress::Phase::kPausing) : find_stop(run, arm, joint, direction);
  if (!found.ok()) return found;
  HomedAxis& axis = found.value();
  axis.angle_at_stop = direction == 0 ? homing.rest_angle[joint] : angle_at_stop(arm.model(), joint, direction);
  axis.raw_at_zero = static_cast<std::uint16_t>(axis.raw_at_stop -
                                                std::lround(arm.model().actuators[joint].ticks(axis.angle_at_stop)));
  if (direction == 0) return found;
  if (const Status paused = run.pause(joint, homing.pause); !paused.ok()) return paused.error();
  // A stop at which the joint stood at power-up proves nothing to the next program (ZeroProof): a little out of it.
  const Status left = run.leave(joint, -direction * homing.slow_ticks_per_s, [&] {
    return std::abs(static_cast<std::int16_t>(arm.encoder(joint).raw())) >= kClearOfPowerUp;
  });
  if (!left.ok()) return left.error();
  return found;
}

/// Errors: that the zero which held until now has the stop elsewhere.
Status compare(HomedAxis& axis, const std::optional<ExpectedZero>& expected, const Arm5e& arm, Joint joint) {
  const HomingSettings& homing = arm.settings().homing;
  if (!expected || homing.direction[joint] == HomeDirection::kNone) return {};
  axis.from_expected_ticks = ticks_between(axis.raw_at_zero, expected->raw[joint]);
  if (!expected->held || std::abs(*axis.from_expected_ticks) <= homing.agreement_ticks) return {};
  return Error{ErrorCode::kOutOfRange, 0, {}, "arm: its stop is not where the zero that held until now has it"};
}

void check(const HomingJob& job) {
  const int fast = job.arm.settings().homing.speed_ticks_per_s;
  if (fast > job.settings.limits.ticks_per_s)
    throw InputError(
        fmt::format("devices.arm.homing.speed_ticks_per_s: found {}, expected at most {:g}, "
                    "scan.limits.ticks_per_s",
                    fast, job.settings.limits.ticks_per_s));
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
  if (!error) return "homed";
  return std::string(kJointNames[static_cast<std::size_t>(failed)]) + ": " + error->where + detail;
}

HomingResult home_axes(const HomingJob& job) {
  check(job);
  Arm5e& arm = job.arm;
  HomingRun run(job);
  HomingResult result;
  const auto failed = [&](Joint joint, const Error& error, const std::string& detail = "") {
    result.error = error;
    result.failed = joint;
    result.detail = run.violation() ? ": " + describe(*run.violation()) : detail;
    return result;
  };
  if (const Status ready = run.first_answer(); !ready.ok()) return failed(kSlew, ready.error());
  if (const Status enabled = run.wait_for_box(); !enabled.ok()) return failed(kSlew, enabled.error());
  const std::optional<ExpectedZero> expected = arm.expected_zero();
  arm.forget_zero();
  run.begin();
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto joint = static_cast<Joint>(j);
    auto axis = home_axis(run, arm, joint);
    if (!axis.ok()) return failed(joint, axis.error());
    if (const Status same = compare(axis.value(), expected, arm, joint); !same.ok())
      return failed(joint, same.error(),
                    fmt::format(": {} ticks away; if its way was free, home again", *axis.value().from_expected_ticks));
    result.axes[j] = axis.value();
    run.show(joint, HomingProgress::Phase::kDone);
  }
  if (const Status stopped = run.rest(); !stopped.ok()) return failed(kJawOpening, stopped.error());
  arm.set_zero(result.zero());
  return result;
}

}  // namespace tankrig
