#include "rig/executive/executive.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tankrig {
namespace {

Fault fault_of(JointViolation::Limit limit) noexcept {
  switch (limit) {
    case JointViolation::Limit::kAngle:
    case JointViolation::Limit::kRefusal:
      return Fault::kJointLimit;
    case JointViolation::Limit::kVelocity:
    case JointViolation::Limit::kTicks:
    case JointViolation::Limit::kSetPointStep:
      return Fault::kJointVelocity;
    case JointViolation::Limit::kCurrent:
      return Fault::kJointCurrent;
    case JointViolation::Limit::kFollowingError:
      break;
  }
  return Fault::kFollowingError;
}

/// Of what a driver tells; `otherwise` is what failed.
Fault fault_of(ErrorCode code, Fault otherwise) noexcept {
  if (code == ErrorCode::kInternal) return Fault::kThread;
  return code == ErrorCode::kOverCurrent ? Fault::kJointCurrent : otherwise;
}

}  // namespace

Executive::Executive(const ScanPlan& plan, const ScanSettings& settings, Arm& arm, Laser& laser,
                     std::size_t ring_capacity)
    : plan_(plan),
      settings_(settings),
      guard_(arm, laser, settings.safety),
      rest_(settings.safety.rest_velocity),
      laser_watch_(settings.safety),
      follower_(settings_),
      monitor_(settings.limits, settings.control.following_error_limit),
      ring_(ring_capacity) {
  monitor_.set_reach(plan.reach());
}

void Executive::step(Stamp now, const TimeAsleep& asleep) noexcept {
  CycleRecord record;
  record.stamp = now;
  if (cycle_ == 0) last_news_ = last_step_ = now;
  record.cycle = cycle_++;

  const std::int64_t zero = plan_zero_ns_.load(std::memory_order_acquire);
  record.plan_time = zero == kNotStarted ? -1 : seconds(now - Stamp{zero});
  record.segment = static_cast<std::uint32_t>(plan_.segment_at(record.plan_time));
  record.planned = plan_.at(record.plan_time).q;

  if (state_ == ExecutiveState::kWaiting && record.plan_time >= 0) state_ = ExecutiveState::kRunning;
  if (state_ == ExecutiveState::kRunning && record.plan_time >= plan_.duration()) state_ = ExecutiveState::kDone;
  if (state_ != ExecutiveState::kFault && stop_asked()) state_ = ExecutiveState::kStopped;

  slept_ = suspend_watch_.look(asleep);
  if (slept_) raise(Fault::kSuspended, {ErrorCode::kSuspended, 0, now, "cycle"});  // whatever follows from it
  if (const char* const objection = watch_ ? watch_->objection(now) : nullptr)
    raise(Fault::kGuardian, {ErrorCode::kRefused, 0, now, objection});
  if (overrun_.load(std::memory_order_relaxed))
    raise(Fault::kOverrun, {ErrorCode::kTimeout, 0, now, "cycle: too often late"});
  if (thread_died_.load(std::memory_order_relaxed))
    raise(Fault::kThread, {ErrorCode::kInternal, 0, now, "rig: a thread has ended"});
  read_joints(record);
  read_laser(record);
  check_silence(record);
  check_following(record);
  act(record, decide(record));
  guard_.complete();

  if (state_ == ExecutiveState::kWaiting && joints_) record.planned = joints_->q;
  record.state = state_;
  record.fault = fault_;
  record.error = error_;
  record.violation = violation_;
  record.armed = guard_.state().armed;
  record.holding = guard_.state().holding;
  record.laser_commanded = guard_.laser_commanded();
  last_step_ = now;
  if (listener_) listener_->cycle(record);
  if (!ring_.try_push(record)) dropped_.fetch_add(1, std::memory_order_relaxed);
}

void Executive::read_joints(CycleRecord& record) noexcept {
  const auto news = guard_.read_joints();
  if (!news.ok()) {
    raise(fault_of(news.error().code, Fault::kArmRead), news.error());
  } else if (news.value()) {
    joints_ = *news.value();
    last_news_ = record.stamp;
    record.has_joints = true;
    record.joints = *joints_;
    rest_.add(*joints_);
    raise(monitor_.check_state(*joints_), record.stamp);
  }
}

void Executive::read_laser(CycleRecord& record) noexcept {
  const auto laser = guard_.read_laser();
  if (!laser.ok()) {
    raise(fault_of(laser.error().code, Fault::kLaser), laser.error());
    return;
  }
  record.laser = laser.value();
  loop_closed_ = laser.value().interlock_closed.value_or(true);
  if (const auto wrong = laser_watch_.look(laser.value(), guard_.laser_commanded(), guard_.laser_warm_up(),
                                           record.stamp, record.stamp - last_step_))
    raise(Fault::kLaser, *wrong);
}

void Executive::check_silence(const CycleRecord& record) noexcept {
  if (seconds(record.stamp - last_news_) > settings_.control.feedback_timeout)
    raise(Fault::kArmSilent, {ErrorCode::kTimeout, 0, record.stamp, "arm: no joint state"});
}

void Executive::check_following(CycleRecord& record) noexcept {
  if (state_ != ExecutiveState::kRunning || !joints_) return;
  const JointVector planned = planned_when_measured(plan_, record.plan_time, record.stamp - joints_->stamp, *joints_);
  record.following_error = (planned - joints_->q).cwiseAbs().maxCoeff();
  raise(monitor_.check_following(planned, joints_->q), record.stamp);
}

InterlockOutputs Executive::decide(const CycleRecord& record) noexcept {
  const Segment& segment = plan_.segments()[record.segment];
  const bool running = state_ == ExecutiveState::kRunning;
  const Duration silence{record.stamp.ns - heartbeat_ns_.load(std::memory_order_relaxed)};
  const bool fresh = seconds(silence) <= settings_.control.heartbeat_timeout;
  if (running && !fresh && heartbeat_ns_.load(std::memory_order_relaxed) != 0)
    raise(Fault::kHeartbeat, {ErrorCode::kTimeout, 0, record.stamp, "executive: heartbeat"});
  InterlockInputs in;
  in.now = record.stamp;
  in.arm = armed_.load(std::memory_order_relaxed);
  in.hold = running && segment.hold;
  in.interlock_closed = interlock_.load(std::memory_order_relaxed) && loop_closed_;
  in.heartbeat_fresh = fresh;
  in.at_rest = rest_.at_rest();
  in.sweeping = running && segment.sweeping;
  in.device_fault = std::exchange(raised_, false);
  in.slept = slept_;
  in.laser_request = running && laser_request(record, segment);
  in.beam = beam_.load(std::memory_order_relaxed);
  in.enabled = !box_ || box_->enabled(record.stamp);

  const bool hold_asked = in.hold && !guard_.state().last_hold;
  const InterlockOutputs allowed = guard_.step(in);
  raise(allowed.trip, in.beam, record.stamp);
  if (hold_asked && guard_.state().armed && !guard_.state().holding)  // the edge is lost: it would stay dark
    raise(Fault::kHoldRefused, {ErrorCode::kRefused, 0, record.stamp, "arm: expected at rest"});
  return allowed;
}

void Executive::raise(Trip trip, BeamVerdict beam, Stamp now) noexcept {
  if (trip == Trip::kHeartbeat) raise(Fault::kHeartbeat, {ErrorCode::kTimeout, 0, now, "executive: heartbeat"});
  if (trip == Trip::kInterlock) raise(Fault::kInterlock, {ErrorCode::kRefused, 0, now, "laser: interlock open"});
  if (trip == Trip::kDisabled)
    raise(Fault::kDisabled, {ErrorCode::kRefused, 0, now, "watchdog box: its contactors are open"});
  if (trip == Trip::kMaximumOn) raise(Fault::kMaximumOn, {ErrorCode::kTimeout, 0, now, "laser: maximum on-time"});
  if (trip == Trip::kMotion) raise(Fault::kMovedInHold, {ErrorCode::kRefused, 0, now, "arm: expected at rest"});
  if (trip == Trip::kBeam && beam == BeamVerdict::kMissing)
    raise(Fault::kBeamMissing, {ErrorCode::kProtocol, 0, now, "laser: on, but no camera sees its stripe"});
  if (trip == Trip::kBeam && beam == BeamVerdict::kStray)
    raise(Fault::kBeamStray, {ErrorCode::kProtocol, 0, now, "laser: off, but a camera sees its stripe"});
}

bool Executive::laser_request(const CycleRecord& record, const Segment& segment) const noexcept {
  if (!segment.laser || !settings_.capture.laser_pairs) return segment.laser;
  // Frames are at mid-exposure at whole frame periods of plan time: switch half-way between them.
  return static_cast<std::int64_t>(std::floor(record.plan_time / settings_.capture.frame_period + 0.5)) % 2 == 0;
}

/// Set-points towards the plan; rest where there is nothing to follow. What the monitor refuses is a fault.
JointVector Executive::follow(const CycleRecord& record) noexcept {
  if (state_ != ExecutiveState::kRunning || !joints_) return JointVector::Zero();
  const JointVector velocity = follower_.step(plan_, record.plan_time, record.stamp - joints_->stamp, *joints_);
  raise(monitor_.check_set_point(velocity, *joints_), record.stamp);
  return velocity;
}

void Executive::act(CycleRecord& record, const InterlockOutputs& allowed) noexcept {
  if (guard_.state().latched) state_ = ExecutiveState::kFault;
  if (state_ != ExecutiveState::kWaiting && state_ != ExecutiveState::kRunning) {
    force_safe(record);
    return;
  }
  if (allowed.motion) record.desired = follow(record);
  if (stop_asked()) {  // since this step began, which may be long ago: the next one says so
    force_safe(record);
    return;
  }
  if (!raised_) write_outputs(record);
  if (raised_) {
    state_ = ExecutiveState::kFault;
    force_safe(record);
  }
}

void Executive::write_outputs(CycleRecord& record) noexcept {
  if (const Status done = guard_.switch_laser(); !done.ok()) {
    raise(Fault::kLaser, {done.error().code, done.error().os_errno, record.stamp, done.error().where});
    return;
  }
  const auto applied = guard_.move(record.desired);
  if (applied.ok())
    record.applied = applied.value();
  else
    raise(fault_of(applied.error().code, Fault::kArmWrite), applied.error());
}

/// Laser off first, then the arm; again in every cycle, because a command may fail or be lost.
void Executive::force_safe(CycleRecord& record) noexcept {
  record.laser_off = guard_.laser_off();
  record.arm_stop = guard_.arm_stop();
  record.desired.setZero();
  if (!record.laser_off.ok()) raise(Fault::kLaser, record.laser_off.error());
  if (record.arm_stop.ok())
    record.applied.setZero();
  else
    raise(Fault::kArmWrite, record.arm_stop.error());
}

/// The first fault is the one that is told.
void Executive::raise(Fault fault, const Error& error) noexcept {
  raised_ = true;
  if (fault_ != Fault::kNone) return;
  fault_ = fault;
  error_ = error;
}

void Executive::raise(const JointMonitor::Answer& violation, Stamp now) noexcept {
  if (!violation) return;
  if (fault_ == Fault::kNone) violation_ = violation;
  raise(fault_of(violation->kind), {ErrorCode::kOutOfRange, 0, now, "arm: joint monitor"});
}

}  // namespace tankrig
