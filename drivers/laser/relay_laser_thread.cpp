// The laser relay's device thread: what is sent, what is answered, and what follows when it is not.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "core/thread_priority.hpp"
#include "drivers/laser/relay_laser.hpp"

namespace tankrig {
namespace {

constexpr int kPriority = 78;  // below the cycle's, above the triggers'
constexpr Duration kLongestWait = Heartbeat::kUsual / 4;
constexpr Duration kReopenPeriod = std::chrono::milliseconds{100};
constexpr int kLateAnswers = 20;  // so many answer time-outs long an answer may still come
constexpr Duration kQuietAfterGarbage = std::chrono::milliseconds{10};

}  // namespace

void RelayLaser::run() {
  set_fifo("laser-relay", kPriority);
  try {
    while (!stop_) step();
  } catch (...) {
    life_.end();
  }
  last_off();
}

void RelayLaser::step() {
  const Stamp t = now();
  life_.give(t);
  if (suspend_watch_.look(clock_.asleep())) {
    if (waiting_for_ != Request::kNone) abandon();
    distrust(ErrorCode::kSuspended, 0);
  }
  if (port_.descriptor() < 0) {
    reconnect();
    return;
  }
  bool on = (command_.load() & kOn) != 0 && !forbidden();
  if (on && t - Stamp{last_call_ns_.load(std::memory_order_relaxed)} > settings_.caller_timeout) {
    command_.fetch_and(static_cast<std::uint8_t>(~kOn));
    ++counts_.caller_timeouts;
    on = false;
  }
  const Request wanted = on ? Request::kOn : Request::kOff;
  on_taken_ = on_taken_ && on;
  const bool off_overtakes =
      wanted == Request::kOff &&
      (waiting_for_ == Request::kOn || (waiting_for_ == Request::kQuery && confirmed_ != Request::kOff));
  if (off_overtakes) {
    abandon();
    send(Request::kOff);
  } else if (waiting_for_ == Request::kNone && t >= not_before(wanted)) {
    if (wanted != confirmed_ && !withheld()) {
      send(wanted);
    } else if (settings_.refresh.count() > 0 && t >= refresh_at_ && !withheld()) {
      ++counts_.refreshes;
      send(wanted);
    } else if (settings_.protocol.status_query && t >= query_at_) {
      ++counts_.queries;
      send(Request::kQuery);
    }
  }
  if (port_.descriptor() < 0) return;
  Stamp until = deadline_;
  if (waiting_for_ == Request::kNone) {
    until = t + kLongestWait;
    if (settings_.refresh.count() > 0 && !withheld()) until = std::min(until, refresh_at_);
    if (settings_.protocol.status_query) until = std::min(until, query_at_);
    if ((wanted != confirmed_ && !withheld()) || quiet_until_ > until) until = not_before(wanted);
  }
  if (on)
    until = std::min(until, Stamp{last_call_ns_.load(std::memory_order_relaxed)} + settings_.caller_timeout +
                                std::chrono::milliseconds{1});
  wait(until);
  receive();
  if (waiting_for_ != Request::kNone && now() >= deadline_) {
    ++counts_.echoes_missing;
    abandon();
    failed(ErrorCode::kTimeout, 0);
  }
}

/// After noise the line is left to fall quiet; but noise that never ends must not keep an off from being sent.
Stamp RelayLaser::not_before(Request wanted) const noexcept {
  if (wanted == Request::kOn || confirmed_ == Request::kOff) return quiet_until_;
  return std::min(quiet_until_, sent_ + kQuietAfterGarbage);
}

void RelayLaser::wait(Stamp until) noexcept {
  const Duration left = std::max(until - now(), Duration{0});
  const timespec timeout{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
  pollfd doors[2] = {{wake_, POLLIN, 0}, {port_.descriptor(), POLLIN, 0}};
  if (::ppoll(doors, port_.descriptor() >= 0 ? 2 : 1, &timeout, nullptr) > 0 && doors[0].revents) {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t taken = ::read(wake_, &count, sizeof count);
  }
}

void RelayLaser::send(Request request) noexcept {
  const RelayProtocol& p = settings_.protocol;
  const std::uint8_t byte =
      request == Request::kQuery ? *p.status_query : p.command(request == Request::kOn && !forbidden());
  sent_ = now();
  deadline_ = sent_ + settings_.answer_timeout;
  waiting_for_ = request;
  if (request != Request::kQuery) {
    ++counts_.commands;
    refresh_at_ = sent_ + settings_.refresh;
    if (byte == p.on_byte) last_on_ = sent_;
  } else {
    query_at_ = sent_ + settings_.query_period;
  }
  const auto written = port_.try_write({&byte, 1});
  if (!written.ok()) distrust(written.error().code, written.error().os_errno);
}

void RelayLaser::receive() {
  std::array<std::uint8_t, 64> bytes;
  const auto got = port_.try_read(bytes);
  if (!got.ok()) {
    distrust(got.error().code, got.error().os_errno);
    return;
  }
  for (std::size_t i = 0; i < got.value(); ++i)
    if (!take(bytes[i])) return;  // the rest is noise
}

bool RelayLaser::answers(Request request, std::uint8_t byte) const noexcept {
  if (request == Request::kQuery) return decode_relay_status(byte).has_value();
  return byte == settings_.protocol.command(request == Request::kOn);
}

/// Its answer may still come.
void RelayLaser::abandon() noexcept {
  if (abandoned_count_ == abandoned_.size()) forget_abandoned(0);
  abandoned_[abandoned_count_++] = std::exchange(waiting_for_, Request::kNone);
  late_until_ = now() + kLateAnswers * settings_.answer_timeout;
}

void RelayLaser::forget_abandoned(std::size_t which) noexcept {
  std::copy(abandoned_.begin() + static_cast<std::ptrdiff_t>(which) + 1, abandoned_.end(),
            abandoned_.begin() + static_cast<std::ptrdiff_t>(which));
  --abandoned_count_;
}

bool RelayLaser::take(std::uint8_t byte) {
  if (waiting_for_ != Request::kNone && answers(waiting_for_, byte)) {
    answered(byte);
    return true;
  }
  if (now() > late_until_) abandoned_count_ = 0;
  for (std::size_t i = 0; i < abandoned_count_; ++i) {
    if (!answers(abandoned_[i], byte)) continue;
    forget_abandoned(i);
    ++counts_.late_answers;
    return true;
  }
  ++counts_.wrong_echoes;
  wrong_byte_ = byte;
  [[maybe_unused]] const Status discarded = port_.discard_input();
  quiet_until_ = now() + kQuietAfterGarbage;
  failed(ErrorCode::kProtocol, 0);
  return false;
}

void RelayLaser::answered(std::uint8_t byte) {
  const std::int64_t took = (now() - sent_).count();
  if (took > counts_.slowest_answer_ns) counts_.slowest_answer_ns = took;
  const Request request = std::exchange(waiting_for_, Request::kNone);
  const bool query = settings_.protocol.status_query.has_value();
  failures_ = 0;
  if (request == Request::kQuery) {
    const RelayStatus status = *decode_relay_status(byte);
    reading_.interlock_closed = status.interlock_closed;
    set_powered(status.closed);
    if (withheld() && !status.closed && status.interlock_closed && opened_after_ns_ == 0)
      opened_after_ns_ = std::max<std::int64_t>((now() - last_on_).count(), 1);
  } else {
    if (confirmed_ != request) query_at_ = Stamp{};
    confirmed_ = request;
    on_taken_ = request == Request::kOn;
    off_echoed_ = true;
    if (!query) set_powered(request == Request::kOn);
  }
  if (!reading_.trusted && confirmed_ == Request::kOff && (!query || request == Request::kQuery)) {
    reading_.trusted = true;
    if (std::exchange(lost_, false)) ++counts_.reconnects;
    publish();
    command_.fetch_or(kReady);
    const std::lock_guard lock(opening_mutex_);
    opened_ = true;
    opening_.notify_all();
    return;
  }
  publish();
}

void RelayLaser::failed(ErrorCode code, int os_errno) noexcept {
  waiting_for_ = Request::kNone;
  confirmed_ = Request::kNone;
  if (++failures_ >= settings_.attempts) distrust(code, os_errno);
}

void RelayLaser::distrust(ErrorCode code, int os_errno) noexcept {
  waiting_for_ = Request::kNone;
  confirmed_ = Request::kNone;
  if (command_.exchange(0) & kOn) ++counts_.latched_off;
  if (port_.descriptor() < 0 && !std::exchange(lost_, true)) ++counts_.disconnects;
  reading_.trusted = false;
  reading_.code = code;
  reading_.os_errno = os_errno;
  publish();
}

void RelayLaser::reconnect() {
  if (reading_.trusted) distrust(ErrorCode::kDisconnected, 0);
  if (port_.reopen().ok()) {
    failures_ = 0;
    abandoned_count_ = 0;
    quiet_until_ = Stamp{};
    return;
  }
  wait(now() + kReopenPeriod);
}

void RelayLaser::set_powered(bool powered) noexcept {
  if (powered == reading_.powered && reading_.changed.ns != 0) return;
  reading_.powered = powered;
  reading_.changed = now();
}

void RelayLaser::publish() noexcept {
  published_.publish(reading_);
  const bool known = reading_.trusted && reading_.interlock_closed;
  loop_ = !known ? Loop::kUnknown : *reading_.interlock_closed ? Loop::kClosed : Loop::kOpen;
}

void RelayLaser::last_off() noexcept {
  for (int attempt = 0; attempt < std::max(settings_.attempts, 2) && port_.descriptor() >= 0; ++attempt) {
    send(Request::kOff);
    while (waiting_for_ == Request::kOff && port_.descriptor() >= 0 && now() < deadline_) {
      if (!port_.wait_readable(deadline_ - now()).ok()) break;
      std::uint8_t byte = 0;
      const auto got = port_.try_read({&byte, 1});
      if (got.ok() && got.value() == 1 && answers(Request::kOff, byte)) return;
    }
  }
}

}  // namespace tankrig
