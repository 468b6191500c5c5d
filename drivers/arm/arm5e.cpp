#include "drivers/arm/arm5e.hpp"

#include <cmath>
#include <utility>

namespace tankrig {
namespace {

constexpr char kReadOnly[] = "arm: opened to be read only";

}  // namespace

Arm5e::Arm5e(const Arm5eSettings& settings, const ArmModel& model, std::unique_ptr<ArmLink> link, const Clock& clock)
    : settings_(settings),
      model_(model),
      clock_(clock),
      bus_load_(carrier_load(settings).load),
      requests_(settings_, std::move(link), clock.now(), counts_),
      encoders_(settings_),
      faults_(settings_) {
  (void)suspend_watch_.look(clock_.asleep());  // the first look: from here on it is seen
  written_ns_ = clock_.now().ns;
  if (clock_.real_time()) keeper_.emplace(clock_, [this](bool suspended, Heartbeat& life) { tend(suspended, life); });
}

Arm5e::~Arm5e() {
  keeper_.reset();
  (void)stop();
}

/// A stop that was wished for meanwhile is sent before, and after, the flag is given back: none is left behind.
void Arm5e::leave() noexcept {
  do {
    if (stop_wanted_.exchange(false)) (void)rest(clock_.now());
    inside_.clear();
  } while (stop_wanted_.load() && enter());
}

void Arm5e::raise(ArmFault fault) noexcept {
  if (!faults_.raise(fault)) return;
  stop_wanted_ = true;
  if (fault == ArmFault::kWater) ++counts_.water_alarms;
  if (fault == ArmFault::kOverCurrent) ++counts_.over_currents;
}

Result<std::optional<JointState>> Arm5e::try_read() noexcept {
  const Stamp now = clock_.now();
  if (!enter()) {
    if (requests_.line_lost()) return Error{ErrorCode::kDisconnected, 0, now, "arm: carrier lost"};
    return std::optional<JointState>{};
  }
  left_ = false;
  if (suspend_watch_.look(clock_.asleep())) raise(ArmFault::kSuspended);
  requests_.listen(now);
  auto news = drain(now);
  if (keeper_ && keeper_->missing(now) && !requests_.line_lost())
    news = Error{ErrorCode::kInternal, 0, now, "arm: its thread is dead or stuck"};
  const Duration unwritten{now.ns - written_ns_.load()};
  if (requests_.driven() && unwritten > settings_.watchdog) {
    ++counts_.watchdog_stops;
    stop_wanted_ = true;
  } else if (!stop_wanted_ && unwritten > 2 * requests_.period()) {
    (void)requests_.send_due(now);  // nobody commands: the readings go on
  }
  publish();
  leave();
  return news;
}

Result<std::optional<JointState>> Arm5e::drain(Stamp now) noexcept {
  std::optional<JointState> newest;
  for (;;) {
    const auto news = requests_.receive(now);
    if (!news.ok()) return news.error();
    if (!news.value()) break;
    if (const auto state = take(*news.value())) newest = state;
  }
  if (const auto fault = faults_.tell(now)) return *fault;
  if (requests_.silent(now)) return Error{ErrorCode::kTimeout, 0, now, "arm: silent"};
  if (encoders_.frozen()) return Error{ErrorCode::kTimeout, 0, now, "arm: repeats old readings though it is driven"};
  return newest;
}

/// Readings, which become a state once the encoders are believed.
std::optional<JointState> Arm5e::take(const ArmRequests::News& news) noexcept {
  if (news.powered_up && homed()) {
    encoders_.restart();
    lose_reference();
  }
  readings_.take(news.answer, settings_.scaling, settings_.tail);
  const bool stalled = readings_.current_a > settings_.homing.stop_current_a;
  const ArmEncoders::Doubts doubts = encoders_.take(readings_, news.answer.has, stalled);
  counts_.jumps_rejected += static_cast<std::uint64_t>(doubts.rejected);
  counts_.jumps += static_cast<std::uint64_t>(doubts.jumped);
  if (doubts.jumped > 0) lose_reference();
  if (!encoders_.started()) return {};
  judge_zero();
  const JointState state = encoders_.state(model_, readings_, homed());
  watch(state);
  return doubts.rejected == 0 ? std::optional(state) : std::nullopt;
}

void Arm5e::judge_zero() noexcept {
  if (const ArmZero* zero = zero_.judge(encoders_.raw())) encoders_.set_zero(zero->raw);
}

void Arm5e::watch(const JointState& state) noexcept {
  raise(faults_.seen_in(readings_));
  if (!homed() || !outside_limits(model_, state.q, settings_.posture_margin)) return;
  zero_.lose("it put a joint outside its limits");
  raise(ArmFault::kPosture);
}

void Arm5e::lose_reference() noexcept {
  zero_.lose("an encoder lost its reference");
  requests_.send_gains_again();
  raise(ArmFault::kEncoder);
}

Status Arm5e::refusal(Stamp now, bool by_ticks) const noexcept {
  if (const Status refused = faults_.refusal(now, by_ticks); !refused.ok()) return refused;
  if (!requests_.connected()) return Error{ErrorCode::kDisconnected, 0, now, "arm: carrier lost"};
  return {};
}

Result<JointVector> Arm5e::write_velocity(const OutputRight& /*right*/, const JointVector& velocity) noexcept {
  const Stamp now = clock_.now();
  if (!enter()) {  // somebody is stopping it, or opening its line
    if (requests_.line_lost()) return Error{ErrorCode::kDisconnected, 0, now, "arm: carrier lost"};
    return JointVector(JointVector::Zero());
  }
  const auto write = [&]() noexcept -> Result<JointVector> {
    if (const Status refused = refusal(now, false); !refused.ok()) return refused.error();
    if (!homed()) return Error{ErrorCode::kNotReady, 0, now, "arm: not homed"};
    if (!zero_.may_move() && !velocity.isZero(0)) return Error{ErrorCode::kRefused, 0, now, kReadOnly};
    auto demand = velocity_demand(model_, settings_.shaping, encoders_.ticks(), velocity);
    if (!demand) return Error{ErrorCode::kOutOfRange, 0, now, "arm: velocity is not a number"};
    make_sendable(*demand);
    set_demand(demand->ticks_per_s, now);
    if (const Status sent = requests_.send_due(now); !sent.ok()) return sent.error();
    return demand->applied;
  };
  const Result<JointVector> written = write();
  leave();
  return written;
}

Status Arm5e::write_ticks(const OutputRight& /*right*/, const TickSpeeds& ticks_per_s) noexcept {
  const Stamp now = clock_.now();
  if (!enter()) return Error{ErrorCode::kRefused, 0, now, "arm: being stopped"};
  const auto write = [&]() noexcept -> Status {
    if (const Status refused = refusal(now, true); !refused.ok()) return refused;
    std::array<double, kJoints> demand;
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (std::abs(ticks_per_s[j]) > kLargestSpeed)
        return Error{ErrorCode::kOutOfRange, 0, now, "arm: speed demand above 4095"};
      if (!zero_.may_move() && ticks_per_s[j] != 0) return Error{ErrorCode::kRefused, 0, now, kReadOnly};
      demand[j] = ticks_per_s[j];
    }
    set_demand(demand, now);
    return requests_.send_due(now);
  };
  const Status written = write();
  leave();
  return written;
}

Status Arm5e::stop() noexcept {
  const Stamp now = clock_.now();
  stop_wanted_ = true;
  if (!enter()) return {};
  stop_wanted_ = false;
  const Status sent = rest(now);
  publish();
  leave();
  return sent;
}

void Arm5e::set_demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept {
  requests_.demand(ticks_per_s);
  encoders_.demand(ticks_per_s, now);
  written_ns_ = now.ns;
}

Status Arm5e::rest(Stamp now) noexcept {
  set_demand({}, now);
  return requests_.send_rest(now);
}

void Arm5e::set_zero(const ArmZero& zero) noexcept {
  while (!enter()) std::this_thread::yield();
  encoders_.set_zero(zero.raw);
  faults_.reference_found();
  zero_.set(zero);
  leave();
}

void Arm5e::forget_zero() noexcept {
  while (!enter()) std::this_thread::yield();
  faults_.reference_found();
  zero_.lose("the arm was homed anew and not to the end");
  leave();
}

void Arm5e::end_motion(bool rests) { zero_.end_motion(rests ? std::optional(encoders_.raw()) : std::nullopt); }

Statistics Arm5e::statistics() const {
  Statistics all = counts_.statistics();
  all.push_back({"homed", homed() ? 1.0 : 0.0});
  all.push_back({"bus_load_percent", 100 * bus_load_});
  const Statistics below = requests_.carrier_statistics();
  all.insert(all.end(), below.begin(), below.end());
  return all;
}

/// The keeper's round: stops an arm whose cycle hangs, or whose machine was suspended, and asks it on until somebody
/// listens again: the stop may be lost, with its line or in an arm that is mute to it. Opens a lost line, which may take
/// its time.
void Arm5e::tend(bool suspended, Heartbeat& life) noexcept {
  const Duration unwritten{clock_.now().ns - written_ns_.load()};
  if (requests_.driven() && (suspended || unwritten > settings_.watchdog)) {
    ++counts_.watchdog_stops;
    left_ = true;
    (void)stop();
    if (requests_.driven()) requests_.send_rest_regardless();  // the cycle hangs inside
  } else if (left_) {
    requests_.send_rest_regardless();
  }
  if (!requests_.line_lost() || !enter()) return;
  if (requests_.reopen().ok()) {
    life.give(clock_.now());
    requests_.line_is_back();
  }
  leave();
}

}  // namespace tankrig
