#include "rig/executive/homing_run.hpp"

#include <cstdlib>

namespace tankrig {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(5);
constexpr Duration kStandstill = std::chrono::milliseconds(100);  ///< at a stop for this long
constexpr Duration kFirstAnswer = std::chrono::seconds(2);
constexpr Duration kShown = std::chrono::milliseconds(100);
constexpr int kStandstillTicks = 3;

Error error_of(Trip trip, Stamp now) noexcept {
  switch (trip) {
    case Trip::kSlept:
      return {ErrorCode::kSuspended, 0, now, "arm: homing ended, the machine was suspended"};
    case Trip::kDisabled:
      return {ErrorCode::kRefused, 0, now, "arm: homing ended, the watchdog box is not enabled"};
    case Trip::kHeartbeat:
      return {ErrorCode::kTimeout, 0, now, "arm: homing ended, it was held up between two of its steps"};
    case Trip::kInterlock:
      return {ErrorCode::kRefused, 0, now, "arm: homing ended, the interlock is open"};
    default:
      return {ErrorCode::kInternal, 0, now, "arm: homing ended by the safety step"};
  }
}

}  // namespace

HomingRun::HomingRun(const HomingJob& job)
    : job_(job),
      guard_(job.arm, job.laser, job.settings.safety),
      laser_watch_(job.settings.safety),
      monitor_(job.settings.limits, job.settings.control.following_error_limit) {
  guard_.tell(job.watch, job.box);
  (void)suspend_watch_.look(job.clock.asleep());
}

std::optional<Error> HomingRun::decide() {
  const Stamp now = job_.clock.now();
  const Duration passed = last_step_ ? now - *last_step_ : Duration{0};
  const auto laser = guard_.read_laser();
  if (!laser.ok()) return laser.error();
  if (const auto wrong = laser_watch_.look(laser.value(), false, guard_.laser_warm_up(), now, passed)) return *wrong;
  InterlockInputs in;
  in.now = now;
  in.homing = begun_;
  in.enabled = !job_.box || job_.box->enabled(now);
  in.interlock_closed =
      job_.interlock_closed && job_.interlock_closed() && laser.value().interlock_closed.value_or(true);
  in.heartbeat_fresh = seconds(passed) <= job_.settings.control.heartbeat_timeout;
  in.slept = suspend_watch_.look(job_.clock.asleep());
  const Trip trip = guard_.step(in).trip;
  last_step_ = now;
  if (trip == Trip::kNone) return {};
  return error_of(trip, now);
}

Result<bool> HomingRun::step(Joint joint, int ticks_per_s) {
  read_failed_ = false;
  if (job_.stop) return Error{ErrorCode::kRefused, 0, job_.clock.now(), "arm: homing interrupted"};
  const Stamp now = job_.clock.now();
  if (const char* const objection = job_.watch ? job_.watch->objection(now) : nullptr)
    return Error{ErrorCode::kRefused, 0, now, objection};
  if (const auto refused = decide()) return *refused;
  TickSpeeds demand{};
  demand[joint] = ticks_per_s;
  if (const Status dark = guard_.switch_laser(); !dark.ok()) return dark.error();
  if (const Status written = guard_.home(demand); !written.ok()) return written.error();
  guard_.complete();
  job_.clock.sleep_until(job_.clock.now() + kStep);
  const auto state = guard_.read_joints();
  read_failed_ = !state.ok();
  if (!state.ok()) return state.error();
  if (!state.value()) return false;
  if (begun_) violation_ = monitor_.check_state(*state.value());
  if (violation_) return Error{ErrorCode::kOutOfRange, 0, job_.clock.now(), "arm: homing ended, joint monitor"};
  return true;
}

Status HomingRun::first_answer() {
  for (const Stamp end = job_.clock.now() + kFirstAnswer; job_.clock.now() < end;) {
    const auto news = step(kSlew, 0);
    if (news.ok() && news.value()) return {};
    if (!news.ok() && !may_end(news.error())) return news.error();
  }
  return Error{ErrorCode::kTimeout, 0, job_.clock.now(), "arm: silent"};
}

Status HomingRun::wait_for_box() {
  if (!job_.box) return {};
  for (const Stamp begin = job_.clock.now(); !job_.box->enabled(job_.clock.now());) {
    if (job_.clock.now() - begin > job_.box->enable_wait())
      return Error{ErrorCode::kTimeout, 0, job_.clock.now(),
                   "watchdog box: not enabled in time, expected somebody to press its button"};
    const auto news = step(kSlew, 0);
    if (!news.ok() && !may_end(news.error())) return news.error();
    show(kSlew, Phase::kWaitingForBox);
  }
  return {};
}

Status HomingRun::pause(Joint joint, Duration length) {
  for (const Stamp end = job_.clock.now() + length; job_.clock.now() < end;) {
    const auto news = step(joint, 0);
    if (!news.ok()) return news.error();
    show(joint, Phase::kPausing);
  }
  return {};
}

/// One reading will not do: a false one may lie where the joint could be.
Result<HomedAxis> HomingRun::drive(Joint joint, int ticks_per_s, Phase phase) {
  const Arm5e& arm = job_.arm;
  const HomingSettings& homing = arm.settings().homing;
  const Stamp begin = job_.clock.now();
  const std::int32_t from = arm.encoder(joint).ticks();
  const double range = homing.range_ticks(arm.model(), joint);
  Stamp read{}, since{};
  std::uint16_t place = 0;
  int agreeing = 0;  // readings in a row
  while (job_.clock.now() - begin < homing.longest) {
    const auto news = step(joint, ticks_per_s);
    if (!news.ok()) return news.error();
    show(joint, phase);
    if (ticks_per_s != 0 && std::abs(arm.encoder(joint).ticks() - from) > range)
      return Error{ErrorCode::kOutOfRange, 0, job_.clock.now(), "arm: went beyond its range and found no stop"};
    if (!news.value() || arm.encoder(joint).when() == read) continue;
    read = arm.encoder(joint).when();
    const std::uint16_t raw = arm.encoder(joint).raw();
    const double current_a = arm.readings().current_a;
    const bool moved = std::abs(static_cast<std::int16_t>(static_cast<std::uint16_t>(raw - place))) > kStandstillTicks;
    if (agreeing == 0 || moved || (ticks_per_s != 0 && current_a <= homing.stop_current_a)) {
      place = raw;
      since = read;
      agreeing = 1;
      continue;
    }
    if (++agreeing < arm.settings().encoder.persists_samples || read - since < kStandstill) continue;
    return HomedAxis{.raw_at_stop = raw, .current_a = current_a};
  }
  return Error{ErrorCode::kTimeout, 0, job_.clock.now(),
               ticks_per_s == 0 ? "arm: does not come to rest" : "arm: no stop found in its time"};
}

void HomingRun::show(Joint joint, Phase phase) {
  const Stamp now = job_.clock.now();
  if (!job_.progress || (phase != Phase::kDone && now - shown_ < kShown)) return;
  shown_ = now;
  job_.progress({joint, phase, job_.arm.encoder(joint).raw(), job_.arm.readings().current_a});
}

}  // namespace tankrig
