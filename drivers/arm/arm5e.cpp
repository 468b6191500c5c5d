#include "drivers/arm/arm5e.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/thread_priority.hpp"

namespace tankrig {
namespace {

constexpr double kNoAngle = std::numeric_limits<double>::quiet_NaN();
constexpr int kPatience = 3;  // answer times after which no answer comes any more
constexpr char kReadOnly[] = "arm: opened to be read only";
constexpr auto kKeeperPeriod = std::chrono::milliseconds(50);
constexpr int kKeeperPriority = 77;  // below the cycle's and the laser's: the light goes off first

void add(std::atomic<std::uint64_t>& count) noexcept { count.fetch_add(1, std::memory_order_relaxed); }

const char* send_failure(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::kRefused:
      return "arm: send queue full";
    case ErrorCode::kDisconnected:
      return "arm: carrier lost";
    case ErrorCode::kNotReady:
      return "arm: bus-off";
    default:
      return "arm: send";
  }
}

bool all_at_power_up(const std::array<SensorSlot, kJoints>& joints) noexcept {
  return std::all_of(joints.begin(), joints.end(), [](const SensorSlot& s) { return near_power_up(s.position); });
}

}  // namespace

Arm5e::Arm5e(const Arm5eSettings& settings, const ArmModel& model, std::unique_ptr<ArmLink> link, const Clock& clock)
    : settings_(settings),
      model_(model),
      clock_(clock),
      period_(from_seconds(1 / settings.exchange_rate_hz)),
      rest_(limited({})),
      bus_load_(carrier_load(settings).load),
      link_(std::move(link)),
      schedule_(settings.carrier == ArmCarrier::kCan ? settings.fast_joint : std::nullopt),
      evidence_(settings.silence_timeout),
      heard_(clock.now()),
      faults_(settings_) {
  tracks_.fill(EncoderTrack(settings.encoder));
  const Stamp now = clock_.now();
  (void)suspend_watch_.look(clock_.asleep());  // the first look: from here on it is seen
  (void)keeper_suspend_watch_.look(clock_.asleep());
  next_send_ = listened_ = now;
  written_ns_ = now.ns;
  keeper_life_.give(now);
  if (clock_.real_time()) keeper_ = std::thread([this] { keep(); });
}

Arm5e::~Arm5e() {
  if (keeper_.joinable()) {
    {
      const std::lock_guard lock(keeper_mutex_);
      keeper_ends_ = true;
    }
    keeper_wake_.notify_one();
    keeper_.join();
  }
  (void)stop();
}

/// A stop that was wished for meanwhile is sent before, and after, the flag is given back: none is left behind.
void Arm5e::leave() noexcept {
  do {
    if (stop_wanted_.exchange(false)) {
      rest();
      (void)pump(clock_.now(), !stop_sent_);
    }
    inside_.clear();
  } while (stop_wanted_.load() && enter());
}

void Arm5e::raise(ArmFault fault) noexcept {
  if (!faults_.raise(fault)) return;
  stop_wanted_ = true;
  if (fault == ArmFault::kWater) add(water_alarms_);
  if (fault == ArmFault::kOverCurrent) add(over_currents_);
}

Result<std::optional<JointState>> Arm5e::try_read() noexcept {
  const Stamp now = clock_.now();
  if (!enter()) {
    if (line_lost_) return Error{ErrorCode::kDisconnected, 0, now, "arm: carrier lost"};
    return std::optional<JointState>{};
  }
  if (suspend_watch_.look(clock_.asleep())) raise(ArmFault::kSuspended);
  if (now - std::exchange(listened_, now) > settings_.silence_timeout / 2) heard_.everything(now);
  auto news = drain(now);
  if (keeper_.joinable() && keeper_life_.missing(now) && !line_lost_)
    news = Error{ErrorCode::kInternal, 0, now, "arm: its thread is dead or stuck"};
  const Duration unwritten{now.ns - written_ns_.load()};
  if (driven_ && unwritten > settings_.watchdog) {
    add(watchdog_stops_);
    stop_wanted_ = true;
  } else if (!stop_wanted_ && unwritten > 2 * period_) {
    (void)pump(now, false);  // nobody commands: the readings go on
  }
  publish();
  leave();
  return news;
}

Result<std::optional<JointState>> Arm5e::drain(Stamp now) noexcept {
  std::optional<JointState> newest;
  for (;;) {
    const bool asked = link_->outstanding() > 0;
    const auto received = link_->try_receive(now);
    if (!received.ok()) {
      lose();
      const Error& error = received.error();
      return Error{error.code, error.os_errno, now, "arm: carrier lost"};
    }
    connected_ = true;
    if (!received.value()) break;
    const auto state = take(*received.value(), asked, now);
    if (state) newest = state;
  }
  if (const auto fault = faults_.tell(now)) return *fault;
  if (silent(now)) {
    if (!was_silent_) gains_answered_ = false;
    was_silent_ = true;
    schedule_.begin_whole();
    return Error{ErrorCode::kTimeout, 0, now, "arm: silent"};
  }
  if (evidence_.frozen()) return Error{ErrorCode::kTimeout, 0, now, "arm: repeats old readings though it is driven"};
  return newest;
}

bool Arm5e::silent(Stamp now) const noexcept { return now - heard_.oldest() > settings_.silence_timeout; }

Duration Arm5e::answer_time() const noexcept { return link_->exchange_time() + settings_.reply_timeout; }

void Arm5e::lose() noexcept {
  if (connected_) add(disconnects_);
  connected_ = stop_sent_ = in_time_ = false;
  stop_awaits_ = 0;
  gains_answered_ = false;
  gains_next_ = true;
  line_lost_ = link_->needs_reopen();
}

/// Nothing in an answer says to which request it is: one that is later than any may be comes in the next one's time, so
/// the first after a gap is not believed. `asked`: a request was outstanding.
bool Arm5e::is_late(const ArmAnswer& answer, bool asked) noexcept {
  const bool in_time = asked && answer.read <= asked_at_ + answer_time();
  return !std::exchange(in_time_, in_time) || !in_time;
}

/// The answer to the gains, or readings, which become a state once the encoders are believed.
std::optional<JointState> Arm5e::take(const ArmAnswer& answer, bool asked, Stamp now) noexcept {
  add(exchanges_);
  if (stop_awaits_ > 0) --stop_awaits_;
  const bool late = is_late(answer, asked);
  if (late) add(late_answers_);
  const bool sensors = answer.sensors && !late;
  if (sensors) heard_.of(answer.has, now);
  const bool returned = was_silent_ && sensors && answer.has.whole();
  if (returned) was_silent_ = silent(now);
  if (gains_last_)
    gains_answered_ = true;
  else if (!gains_answered_)
    gains_next_ = true;
  if (!sensors) return {};
  if (returned && homed() && all_at_power_up(answer.joints) && !all_at_power_up(last_.joints)) {
    for (EncoderTrack& track : tracks_) track.restart();
    lose_reference();
  }
  note(answer);

  const bool stalled = readings_.current_a > settings_.homing.stop_current_a;
  bool measured = true;
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (!holds(answer.has.sensors, j)) continue;
    switch (tracks_[j].take(answer.joints[j].position, readings_.stamp)) {
      case EncoderTrack::Reading::kRejected:
        add(jumps_rejected_);
        measured = false;
        break;
      case EncoderTrack::Reading::kJumped:
        add(jumps_);
        lose_reference();
        break;
      case EncoderTrack::Reading::kStarting:
        break;
      case EncoderTrack::Reading::kGood:
        evidence_.read(j, tracks_[j].raw(), readings_.stamp, stalled);
        break;
    }
  }
  if (!std::all_of(tracks_.begin(), tracks_.end(), [](const EncoderTrack& t) { return t.started(); })) return {};
  judge_zero();
  const JointState joints = state();
  watch(joints);
  return measured ? std::optional(joints) : std::nullopt;
}

JointState Arm5e::state() const noexcept {
  JointState state;
  state.stamp = readings_.stamp;
  state.current_a = readings_.current_a;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const int row = static_cast<int>(j);
    state.age[j] = state.stamp - tracks_[j].when();
    state.ticks[j] = tracks_[j].ticks();
    state.q[row] = homed() ? model_.actuators[j].angle(state.ticks[j]) : kNoAngle;
    state.velocity[row] = homed() ? tracks_[j].speed() * signed_slope(model_.actuators[j], state.ticks[j]) : kNoAngle;
  }
  return state;
}

void Arm5e::note(const ArmAnswer& answer) noexcept {
  if (answer.joints != last_.joints || answer.master != last_.master) changed_in_round_ = true;
  if (answer.has.master && !std::exchange(changed_in_round_, false) && driven_) add(stale_);
  last_ = answer;
  readings_.take(answer, settings_.scaling, settings_.tail);
}

void Arm5e::watch(const JointState& state) noexcept {
  raise(faults_.seen_in(readings_));
  if (!homed() || !outside_limits(model_, state.q, settings_.posture_margin)) return;
  homed_ = false;
  lost_ = "it put a joint outside its limits";
  raise(ArmFault::kPosture);
}

/// The arm may have been without supply, and has forgotten its gains too.
void Arm5e::lose_reference() noexcept {
  homed_ = gains_answered_ = false;
  lost_ = "an encoder lost its reference";
  gains_next_ = true;
  raise(ArmFault::kEncoder);
}

Status Arm5e::refusal(Stamp now, bool by_ticks) const noexcept {
  if (const Status refused = faults_.refusal(now, by_ticks); !refused.ok()) return refused;
  if (!connected_) return Error{ErrorCode::kDisconnected, 0, now, "arm: carrier lost"};
  return {};
}

Result<JointVector> Arm5e::write_velocity(const JointVector& velocity) noexcept {
  const Stamp now = clock_.now();
  if (!enter()) {  // somebody is stopping it, or opening its line
    if (line_lost_) return Error{ErrorCode::kDisconnected, 0, now, "arm: carrier lost"};
    return JointVector(JointVector::Zero());
  }
  const auto write = [&]() noexcept -> Result<JointVector> {
    if (const Status refused = refusal(now, false); !refused.ok()) return refused.error();
    if (!homed()) return Error{ErrorCode::kNotReady, 0, now, "arm: not homed"};
    if (!may_move_ && !velocity.isZero(0)) return Error{ErrorCode::kRefused, 0, now, kReadOnly};
    std::array<double, kJoints> ticks;
    for (std::size_t j = 0; j < kJoints; ++j) ticks[j] = tracks_[j].ticks();
    auto demand = velocity_demand(model_, settings_.shaping, ticks, velocity);
    if (!demand) return Error{ErrorCode::kOutOfRange, 0, now, "arm: velocity is not a number"};
    make_sendable(*demand);
    set_demand(demand->ticks_per_s, now);
    if (const Status sent = pump(now, false); !sent.ok()) return sent.error();
    return demand->applied;
  };
  const Result<JointVector> written = write();
  leave();
  return written;
}

Status Arm5e::write_ticks(const std::array<int, kJoints>& ticks_per_s) noexcept {
  const Stamp now = clock_.now();
  if (!enter()) return Error{ErrorCode::kRefused, 0, now, "arm: being stopped"};
  const auto write = [&]() noexcept -> Status {
    if (const Status refused = refusal(now, true); !refused.ok()) return refused;
    std::array<double, kJoints> demand;
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (std::abs(ticks_per_s[j]) > kLargestSpeed)
        return Error{ErrorCode::kOutOfRange, 0, now, "arm: speed demand above 4095"};
      if (!may_move_ && ticks_per_s[j] != 0) return Error{ErrorCode::kRefused, 0, now, kReadOnly};
      demand[j] = ticks_per_s[j];
    }
    set_demand(demand, now);
    return pump(now, false);
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
  rest();
  const Status sent = pump(now, !stop_sent_);
  publish();
  leave();
  return sent;
}

/// Past whoever is inside, who may be dead.
void Arm5e::last_resort() noexcept {
  dying_ = true;
  link_->send_regardless(rest_);
}

void Arm5e::rest() noexcept { set_demand({}, clock_.now()); }

void Arm5e::set_demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept {
  bool driven = false;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto speed = static_cast<std::uint16_t>(std::min<double>(std::abs(ticks_per_s[j]), kLargestSpeed));
    const DemandType moving = ticks_per_s[j] > 0 ? DemandType::kSpeedForward : DemandType::kSpeedBackward;
    demands_[j] = {};
    if (speed != 0) demands_[j] = {moving, speed, 0, 0};
    evidence_.demand(j, speed, now);
    driven = driven || speed != 0;
  }
  driven_ = driven;
  written_ns_ = now.ns;
}

/// The request is altered where that means nothing, for an arm that went mute. If nobody has listened since it was
/// sent, its answer may well lie there unread: that is not a time-out.
void Arm5e::repeat(Stamp now) noexcept {
  next_send_ = now;
  if (listened_ >= sent_at_ + kPatience * answer_time()) {
    link_->forget();
    in_time_ = false;
  }
  if (listened_ <= sent_at_) return;
  add(timeouts_);
  add(mute_retries_);
  wobble_ = !wobble_;
  if (!gains_answered_) gains_next_ = !gains_last_;
}

/// Sends what is due: the gains first, then the newest demands, at the exchange rate; `at_once` only rest may be sent.
Status Arm5e::pump(Stamp now, bool at_once) noexcept {
  const int patience = stop_awaits_ > 0 && !driven_ ? 1 : kPatience;
  const bool unanswered = link_->outstanding() > 0 && now >= sent_at_ + patience * answer_time();
  if (unanswered) repeat(now);
  if (!at_once) {
    if (link_->outstanding() > 0 && !unanswered) {
      const Status sends = link_->sends();
      return sends.ok() ? sends : Error{sends.error().code, 0, now, send_failure(sends.error().code)};
    }
    const Duration slack = std::min<Duration>(period_ / 8, std::chrono::milliseconds(1));
    if (now + slack < next_send_) return {};
  }
  const ArmExchange exchange = at_once ? ArmExchange{} : schedule_.next();
  const bool gains = gains_next_ && !at_once;
  const bool rest = !driven_;
  if (link_->outstanding() == 0) asked_at_ = now;
  if (!gains && !rest) stop_sent_ = false;  // also where the carrier takes only a part of it
  const Status sent = gains ? link_->try_send(settings_.pid, now) : send(exchange, now);
  if (!sent.ok()) {
    const Error& error = sent.error();
    if (error.code == ErrorCode::kRefused && !at_once) return {};  // again in the next cycle
    if (error.code == ErrorCode::kDisconnected) lose();
    return Error{error.code, error.os_errno, now, send_failure(error.code)};
  }
  gains_last_ = gains;
  if (gains) {
    gains_next_ = false;
  } else {
    const bool stopped = std::exchange(stop_sent_, rest && (exchange.whole() || stop_sent_));
    if (!stopped || !stop_sent_) stop_awaits_ = stop_sent_ ? link_->outstanding() : 0;
    if (!at_once) schedule_.advance();
  }
  sent_at_ = now;
  stop_awaits_ = std::min(stop_awaits_, link_->outstanding());
  next_send_ = next_send_ + period_;
  if (next_send_ <= now) next_send_ = now + period_;
  return {};
}

ArmDemands Arm5e::limited(ArmDemands demands) const noexcept {
  for (DemandSlot& demand : demands) {
    demand.speed_limit = settings_.speed_limit;
    demand.current_limit = settings_.current_limit;
  }
  demands[kJawOpening].current_limit = settings_.jaw_current_limit;
  return demands;
}

Status Arm5e::send(const ArmExchange& exchange, Stamp now) noexcept {
  if (dying_) return link_->try_send(rest_, exchange, now);
  ArmDemands demands = limited(demands_);
  if (wobble_) demands[kJawRotate].speed_limit ^= 1U;
  return link_->try_send(demands, exchange, now);
}

void Arm5e::set_zero(const ArmZero& zero) noexcept {
  while (!enter()) std::this_thread::yield();
  for (std::size_t j = 0; j < kJoints; ++j) tracks_[j].set_zero(zero.raw[j]);
  faults_.reference_found();
  homed_ = true;
  lost_ = nullptr;
  if (proof_) proof_->replace(zero);
  leave();
}

void Arm5e::forget_zero() noexcept {
  while (!enter()) std::this_thread::yield();
  faults_.reference_found();
  homed_ = false;
  lost_ = "the arm was homed anew and not to the end";
  leave();
}

void Arm5e::set_proof(ZeroProof proof) {
  may_move_ = false;
  proof_ = std::move(proof);
}

void Arm5e::judge_zero() noexcept {
  if (!proof_ || !proof_->undecided()) return;
  std::array<std::uint16_t, kJoints> raw;
  for (std::size_t j = 0; j < kJoints; ++j) raw[j] = tracks_[j].raw();
  if (!proof_->judge(raw)) {
    lost_ = "the encoders do not read what they read when it was left";
    return;
  }
  for (std::size_t j = 0; j < kJoints; ++j) tracks_[j].set_zero(proof_->zero()->raw[j]);
  homed_ = true;
}

std::string Arm5e::why_not_homed() const {
  if (!proof_ || homed()) return {};
  const std::string why = proof_->why_not();
  return why.empty() && lost_ ? lost_ : why;
}

void Arm5e::begin_motion() {
  if (proof_) proof_->begin_motion();
  may_move_ = true;
}

void Arm5e::end_motion(bool rests) {
  if (!proof_) return;
  may_move_ = false;
  keep_loss();
  std::optional<std::array<std::uint16_t, kJoints>> raw;
  if (rests && homed()) raw.emplace();
  for (std::size_t j = 0; raw && j < kJoints; ++j) (*raw)[j] = tracks_[j].raw();
  proof_->end_motion(raw);
}

void Arm5e::keep_loss() {
  if (proof_ && lost_) proof_->void_it(why_not_homed());
}

Status Arm5e::clear_faults() noexcept {
  const Stamp now = clock_.now();
  if (!enter()) return Error{ErrorCode::kRefused, 0, now, "arm: being stopped"};
  const Status cleared = faults_.clear(readings_, now);
  leave();
  return cleared;
}

void Arm5e::publish() noexcept {
  const ArmLinkCounters c = link_->counters();
  const std::array<std::uint64_t, 10> values{c.checksum_errors,  c.length_errors, c.discarded_bytes, c.resyncs,
                                             c.wrong_ids,        c.wrong_lengths, c.incomplete,      c.unknown_slots,
                                             c.send_buffer_full, c.reopened};
  for (std::size_t i = 0; i < values.size(); ++i) link_counts_[i].store(values[i], std::memory_order_relaxed);
  current_a_.store(readings_.current_a, std::memory_order_relaxed);
  voltage_v_.store(readings_.voltage_v, std::memory_order_relaxed);
  temperature_c_.store(readings_.master_temperature_c, std::memory_order_relaxed);
}

Statistics Arm5e::statistics() const {
  const auto count = [](const Count& c) { return static_cast<double>(c.load(std::memory_order_relaxed)); };
  Statistics all{{"exchanges", count(exchanges_)},
                 {"timeouts", count(timeouts_)},
                 {"mute_retries", count(mute_retries_)},
                 {"late_answers", count(late_answers_)},
                 {"stale", count(stale_)},
                 {"jumps_rejected", count(jumps_rejected_)},
                 {"jumps", count(jumps_)},
                 {"watchdog_stops", count(watchdog_stops_)},
                 {"over_currents", count(over_currents_)},
                 {"water_alarms", count(water_alarms_)},
                 {"disconnects", count(disconnects_)}};
  constexpr std::array<const char*, 10> kNames{"checksum_errors",  "length_errors", "discarded_bytes", "resyncs",
                                               "wrong_ids",        "wrong_lengths", "incomplete",      "unknown_slots",
                                               "send_buffer_full", "reopened"};
  for (std::size_t i = 0; i < kNames.size(); ++i) all.push_back({kNames[i], count(link_counts_[i])});
  all.push_back({"current_a", current_a_.load()});
  all.push_back({"voltage_v", voltage_v_.load()});
  all.push_back({"temperature_c", temperature_c_.load()});
  all.push_back({"homed", homed() ? 1.0 : 0.0});
  all.push_back({"bus_load_percent", 100 * bus_load_});
  const Statistics below = link_->carrier_statistics();
  all.insert(all.end(), below.begin(), below.end());
  return all;
}

/// The keeper: stops an arm whose cycle hangs, or whose machine was suspended, and opens a lost line, which may take
/// its time.
void Arm5e::keep() try {
  set_fifo("arm-keeper", kKeeperPriority);
  std::unique_lock lock(keeper_mutex_);
  while (!keeper_wake_.wait_for(lock, kKeeperPeriod, [this] { return keeper_ends_; })) {
    const Stamp now = clock_.now();
    keeper_life_.give(now);
    const bool suspended = keeper_suspend_watch_.look(clock_.asleep());
    if (driven_ && (suspended || now.ns - written_ns_.load() > settings_.watchdog.count())) {
      add(watchdog_stops_);
      (void)stop();
      if (driven_) link_->send_regardless(rest_);  // the cycle hangs inside
    }
    if (!line_lost_ || !enter()) continue;
    if (link_->reopen().ok()) {
      keeper_life_.give(clock_.now());
      line_lost_ = false;
    }
    leave();
  }
} catch (...) {
  keeper_life_.end();
}

}  // namespace tankrig
