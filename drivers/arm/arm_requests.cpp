#include "drivers/arm/arm_requests.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/arm/arm_zero.hpp"

namespace tankrig {
namespace {

constexpr int kPatience = 3;  // answer times after which no answer comes any more

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

ArmDemands limited(const Arm5eSettings& settings, ArmDemands demands) noexcept {
  for (DemandSlot& demand : demands) {
    demand.speed_limit = settings.speed_limit;
    demand.current_limit = settings.current_limit;
  }
  demands[kJawOpening].current_limit = settings.jaw_current_limit;
  return demands;
}

ArmDemands altered(ArmDemands demands) noexcept {
  alter(demands);
  return demands;
}

}  // namespace

ArmDemands rest_demands(const Arm5eSettings& settings) noexcept { return limited(settings, {}); }

ArmRequests::ArmRequests(const Arm5eSettings& settings, std::unique_ptr<ArmLink> link, Stamp now, ArmCounts& counts)
    : settings_(settings),
      counts_(counts),
      period_(from_seconds(1 / settings.exchange_rate_hz)),
      rest_(rest_demands(settings)),
      altered_rest_(altered(rest_)),
      link_(std::move(link)),
      schedule_(settings.carrier == ArmCarrier::kCan ? settings.fast_joint : std::nullopt),
      heard_(now),
      next_send_(now),
      listened_(now) {}

void ArmRequests::demand(const std::array<double, kJoints>& ticks_per_s) noexcept {
  bool driven = false;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto speed = static_cast<std::uint16_t>(std::min<double>(std::abs(ticks_per_s[j]), kLargestSpeed));
    const DemandType moving = ticks_per_s[j] > 0 ? DemandType::kSpeedForward : DemandType::kSpeedBackward;
    demands_[j] = {};
    if (speed != 0) demands_[j] = {moving, speed, 0, 0};
    driven = driven || speed != 0;
  }
  driven_ = driven;
}

void ArmRequests::listen(Stamp now) noexcept {
  if (now - std::exchange(listened_, now) > settings_.silence_timeout / 2) heard_.everything(now);
}

Result<std::optional<ArmRequests::News>> ArmRequests::receive(Stamp now) noexcept {
  for (;;) {
    const bool asked = link_->outstanding() > 0;
    const auto received = link_->try_receive(now);
    if (!received.ok()) {
      lose();
      return Error{received.error().code, received.error().os_errno, now, "arm: carrier lost"};
    }
    connected_ = true;
    if (!received.value()) return std::optional<News>{};
    if (const auto news = take(*received.value(), asked, now)) return news;
  }
}

/// The answer to the gains, or readings.
std::optional<ArmRequests::News> ArmRequests::take(const ArmAnswer& answer, bool asked, Stamp now) noexcept {
  ++counts_.exchanges;
  if (stop_awaits_ > 0) --stop_awaits_;
  const bool late = is_late(answer, asked);
  if (late) ++counts_.late_answers;
  const bool sensors = answer.sensors && !late;
  if (sensors) heard_.of(answer.has, now);
  const bool returned = was_silent_ && sensors && answer.has.whole();
  if (returned) was_silent_ = too_long(now);
  if (gains_last_)
    gains_answered_ = true;
  else if (!gains_answered_)
    gains_next_ = true;
  if (!sensors) return {};
  const bool powered_up = returned && all_at_power_up(answer.joints) && !all_at_power_up(last_.joints);
  if (answer.joints != last_.joints || answer.master != last_.master) changed_in_round_ = true;
  if (answer.has.master && !std::exchange(changed_in_round_, false) && driven_) ++counts_.stale;
  last_ = answer;
  return News{answer, powered_up};
}

/// One that is later than any may be comes in the next one's time, so the first after a gap is not believed. `asked`: a
/// request was outstanding.
bool ArmRequests::is_late(const ArmAnswer& answer, bool asked) noexcept {
  const bool in_time = asked && answer.read <= asked_at_ + answer_time();
  return !std::exchange(in_time_, in_time) || !in_time;
}

bool ArmRequests::silent(Stamp now) noexcept {
  if (!too_long(now)) return false;
  if (!was_silent_) gains_answered_ = false;
  was_silent_ = true;
  schedule_.begin_whole();
  return true;
}

void ArmRequests::send_gains_again() noexcept {
  gains_answered_ = false;
  gains_next_ = true;
}

void ArmRequests::lose() noexcept {
  if (connected_) ++counts_.disconnects;
  connected_ = stop_sent_ = in_time_ = false;
  stop_awaits_ = 0;
  send_gains_again();
  line_lost_ = link_->needs_reopen();
}

/// The request is altered where that means nothing, for an arm that went mute. If nobody has listened since it was
/// sent, its answer may well lie there unread: that is not a time-out.
void ArmRequests::repeat(Stamp now) noexcept {
  next_send_ = now;
  if (listened_ >= sent_at_ + kPatience * answer_time()) {
    link_->forget();
    in_time_ = false;
  }
  if (listened_ <= sent_at_) return;
  ++counts_.timeouts;
  ++counts_.mute_retries;
  wobble_ = !wobble_;
  if (!gains_answered_) gains_next_ = !gains_last_;
}

/// `at_once` only rest may be sent.
Status ArmRequests::send(Stamp now, bool at_once) noexcept {
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
  const Status sent = gains ? link_->try_send(settings_.pid, now) : send_demands(exchange, now);
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

Status ArmRequests::send_demands(const ArmExchange& exchange, Stamp now) noexcept {
  ArmDemands demands = forbidden() ? rest_ : limited(settings_, demands_);
  if (wobble_) alter(demands);
  return link_->try_send(demands, exchange, now);
}

}  // namespace tankrig
