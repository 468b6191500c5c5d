#include "rig/executive/executive.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {

Executive::Executive(const ScanPlan& plan, const ScanSettings& settings, Arm& arm, Laser& laser,
                     std::size_t ring_capacity)
    : plan_(plan), settings_(settings), arm_(arm), laser_(laser), ring_(ring_capacity) {}

void Executive::step(Stamp now) noexcept {
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
  if (state_ != ExecutiveState::kFault && stop_.load(std::memory_order_relaxed)) state_ = ExecutiveState::kStopped;

  read_joints(record);
  read_laser(record);
  check_silence(record);
  check_following(record);
  act(record, decide(record));

  record.state = state_;
  record.fault = fault_;
  record.error = error_;
  record.joint = fault_joint_;
  record.laser_commanded = laser_on_;
  last_step_ = now;
  if (!ring_.try_push(record)) dropped_.fetch_add(1, std::memory_order_relaxed);
}

void Executive::read_joints(CycleRecord& record) noexcept {
  const auto news = arm_.try_read();
  if (!news.ok()) {
    raise(Fault::kArmRead, news.error());
  } else if (news.value()) {
    joints_ = *news.value();
    last_news_ = record.stamp;
    record.has_joints = true;
    record.joints = *joints_;
  }
}

void Executive::read_laser(CycleRecord& record) noexcept {
  const auto laser = laser_.state();
  if (!laser.ok()) {
    raise(Fault::kLaser, laser.error());
    return;
  }
  record.laser_known = true;
  record.laser_powered = laser.value().powered;
  record.laser_emitting = laser.value().emitting;
  record.laser_since = laser.value().since;
  loop_closed_ = laser.value().interlock_closed.value_or(true);
  check_laser(record);
}

/// Adds up over short phases too: a laser that switches with every frame is never long in one of them.
void Executive::check_laser(const CycleRecord& record) noexcept {
  const Duration passed = record.stamp - last_step_;
  const bool lit = record.laser_powered || record.laser_emitting;
  if (!lit)
    laser_stray_ = Duration{0};
  else if (!laser_on_)
    laser_stray_ += passed;
  if (record.laser_emitting)
    laser_dark_ = Duration{0};
  else if (laser_on_)
    laser_dark_ += passed;
  if (seconds(laser_stray_) > settings_.laser_off_allowance)
    raise(Fault::kLaser, {ErrorCode::kTimeout, 0, record.stamp, "laser: on though not commanded"});
  if (laser_dark_ > laser_.warm_up() + from_seconds(settings_.laser_on_margin))
    raise(Fault::kLaser, {ErrorCode::kTimeout, 0, record.stamp, "laser: dark after its warm-up"});
}

void Executive::check_silence(const CycleRecord& record) noexcept {
  if (seconds(record.stamp - last_news_) > settings_.feedback_timeout)
    raise(Fault::kArmSilent, {ErrorCode::kTimeout, 0, record.stamp, "arm: no joint state"});
}

void Executive::check_following(CycleRecord& record) noexcept {
  if (state_ != ExecutiveState::kRunning || !joints_) return;
  const double t = record.plan_time - seconds(record.stamp - joints_->stamp);
  const JointVector error = (plan_.at(t).q - joints_->q).cwiseAbs();
  int joint = 0;
  record.following_error = error.maxCoeff(&joint);
  if (record.following_error > settings_.following_error_limit)
    raise(Fault::kFollowingError, {ErrorCode::kOutOfRange, 0, record.stamp, "arm: following error"}, joint);
}

InterlockOutputs Executive::decide(const CycleRecord& record) noexcept {
  const Segment& segment = plan_.segments()[record.segment];
  const bool running = state_ == ExecutiveState::kRunning;
  const Duration silence{record.stamp.ns - heartbeat_ns_.load(std::memory_order_relaxed)};
  const bool fresh = seconds(silence) <= settings_.heartbeat_timeout;
  if (running && !fresh && heartbeat_ns_.load(std::memory_order_relaxed) != 0)
    raise(Fault::kHeartbeat, {ErrorCode::kTimeout, 0, record.stamp, "executive: heartbeat"});
  InterlockInputs in;
  in.arm = armed_.load(std::memory_order_relaxed);
  in.interlock_closed = interlock_.load(std::memory_order_relaxed) && loop_closed_;
  in.heartbeat_fresh = fresh;
  in.sweeping = running && segment.sweeping;
  in.device_fault = fault_ != Fault::kNone;
  in.laser_request = running && laser_request(record, segment);

  const InterlockStep next = tankrig::step(interlock_state_, in);
  interlock_state_ = next.state;
  if (next.outputs.tripped && !in.heartbeat_fresh)
    raise(Fault::kHeartbeat, {ErrorCode::kTimeout, 0, record.stamp, "executive: heartbeat"});
  else if (next.outputs.tripped && !in.interlock_closed)
    raise(Fault::kInterlock, {ErrorCode::kRefused, 0, record.stamp, "laser: interlock open"});
  return next.outputs;
}

bool Executive::laser_request(const CycleRecord& record, const Segment& segment) const noexcept {
  if (!segment.laser || !settings_.laser_pairs) return segment.laser;
  // Frames are at mid-exposure at whole frame periods of plan time: switch half-way between them.
  return static_cast<std::int64_t>(std::floor(record.plan_time / settings_.frame_period + 0.5)) % 2 == 0;
}

/// The plan's velocity, corrected towards its position, for the joints that move in this segment; rest for the others.
JointVector Executive::follow(const CycleRecord& record, const Segment& segment) const noexcept {
  JointVector velocity = JointVector::Zero();
  if (state_ != ExecutiveState::kRunning || !joints_) return velocity;
  const JointVector forward =
      segment.motion.at(record.plan_time + settings_.feed_forward_lead - segment.begin).velocity;
  const double age = seconds(record.stamp - joints_->stamp);
  const JointVector error = plan_.at(record.plan_time - age).q - joints_->q;
  const JointVector way = segment.motion.to() - segment.motion.from();
  for (int j = 0; j < kJoints; ++j) {
    if (way[j] == 0) continue;
    const double side = way[j] > 0 ? 1 : -1;
    const double speed = side * (forward[j] + settings_.position_gain * error[j]);
    const double slowest = settings_.dead_zone[j];
    if (speed < 0.5 * slowest) continue;  // also where the joint is ahead: never against the plan's direction
    velocity[j] = side * std::max(speed, slowest);
  }
  return velocity;
}

void Executive::act(CycleRecord& record, const InterlockOutputs& allowed) noexcept {
  if (!allowed.motion) state_ = ExecutiveState::kFault;
  if (state_ != ExecutiveState::kWaiting && state_ != ExecutiveState::kRunning) {
    make_safe(record);
    return;
  }
  switch_laser(allowed.laser, record);
  record.desired = follow(record, plan_.segments()[record.segment]);
  const auto applied = arm_.write_velocity(record.desired);
  if (applied.ok())
    record.applied = applied.value();
  else
    raise(Fault::kArmWrite, applied.error());
  if (fault_ != Fault::kNone) {
    state_ = ExecutiveState::kFault;
    make_safe(record);
  }
}

void Executive::switch_laser(bool on, CycleRecord& record) noexcept {
  if (on == laser_on_) return;
  const Status done = laser_.set(on);
  if (done.ok())
    laser_on_ = on;
  else
    raise(Fault::kLaser, {done.error().code, done.error().os_errno, record.stamp, done.error().where});
}

/// Laser off first, then the arm; again in every cycle, because a command may fail or be lost.
void Executive::make_safe(CycleRecord& record) noexcept {
  record.laser_off = laser_.set(false);
  record.arm_stop = arm_.stop();
  record.desired.setZero();
  if (record.laser_off.ok())
    laser_on_ = false;
  else
    raise(Fault::kLaser, record.laser_off.error());
  if (record.arm_stop.ok())
    record.applied.setZero();
  else
    raise(Fault::kArmWrite, record.arm_stop.error());
}

/// The first fault is the one that is told.
void Executive::raise(Fault fault, const Error& error, int joint) noexcept {
  if (fault_ != Fault::kNone) return;
  fault_ = fault;
  error_ = error;
  fault_joint_ = joint;
}

const char* to_string(ExecutiveState state) noexcept {
  switch (state) {
    case ExecutiveState::kWaiting:
      return "waiting";
    case ExecutiveState::kRunning:
      return "running";
    case ExecutiveState::kDone:
      return "done";
    case ExecutiveState::kStopped:
      return "stopped";
    case ExecutiveState::kFault:
      return "fault";
  }
  return "?";
}

const char* to_string(Fault fault) noexcept {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kArmRead:
      return "arm read failed";
    case Fault::kArmSilent:
      return "arm silent";
    case Fault::kArmWrite:
      return "arm refused a set-point";
    case Fault::kLaser:
      return "laser failed";
    case Fault::kFollowingError:
      return "following error";
    case Fault::kHeartbeat:
      return "heartbeat late";
    case Fault::kInterlock:
      return "interlock open";
  }
  return "?";
}

}  // namespace tankrig
