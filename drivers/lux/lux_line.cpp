#include "drivers/lux/lux_line.hpp"

#include <algorithm>

namespace tankrig {
namespace {

constexpr Duration kReopenPeriod = std::chrono::milliseconds{50};

}  // namespace

LuxLine::LuxLine(const SerialSettings& serial, Duration reply_timeout, const char* no_answer, const char* no_sense)
    : port_(serial), reply_timeout_(reply_timeout), no_answer_(no_answer), no_sense_(no_sense) {}

Status LuxLine::begin(std::span<const std::uint8_t> request, bool again, Stamp last) {
  if (again) ++retries_;
  while (port_.descriptor() < 0) {
    if (port_.reopen().ok()) {
      ++reconnects_;
      break;
    }
    if (clock_.now() >= last) return failure();
    clock_.sleep_until(std::min(clock_.now() + kReopenPeriod, last));
  }
  count_ = 0;
  ++requests_;
  asked_ = clock_.now();
  deadline_ = std::min(asked_ + reply_timeout_, last);
  if (!port_.discard_input().ok() || !port_.try_write(request).ok()) {
    ++disconnects_;
    if (clock_.now() >= last) return failure();
  }
  return {};
}

/// Brings what may be a whole answer to the front.
bool LuxLine::find(std::span<const std::uint8_t> prefix, std::size_t length) {
  while (count_ > 0) {
    const std::size_t known = std::min(count_, prefix.size());
    if (std::equal(prefix.begin(), prefix.begin() + static_cast<std::ptrdiff_t>(known), bytes_.begin()))
      return count_ >= length;
    skip();
  }
  return false;
}

void LuxLine::skip() {
  ++skipped_bytes_;
  std::copy(bytes_.begin() + 1, bytes_.begin() + static_cast<std::ptrdiff_t>(count_), bytes_.begin());
  --count_;
}

void LuxLine::take(std::size_t length) {
  ++replies_;
  count_ -= length;
}

/// False when this question's time is over, or the line is gone.
bool LuxLine::receive() {
  if (port_.descriptor() < 0) return false;
  const Status ready = port_.wait_readable(deadline_ - clock_.now());
  if (ready.ok()) {
    const auto got = port_.try_read(std::span(bytes_).subspan(count_));
    if (got.ok()) {
      heard_ = heard_ || got.value() > 0;
      count_ += got.value();
      return clock_.now() < deadline_ || got.value() > 0;
    }
  } else if (ready.error().code == ErrorCode::kTimeout) {
    ++(count_ > 0 ? wrong_replies_ : timeouts_);
    return false;
  }
  ++disconnects_;
  return false;
}

Error LuxLine::failure() const noexcept {
  if (port_.descriptor() < 0)
    return {ErrorCode::kDisconnected, 0, clock_.now(), "lux meter: its line is gone: plug it in again"};
  if (heard_) return {ErrorCode::kProtocol, 0, clock_.now(), no_sense_};
  return {ErrorCode::kTimeout, 0, clock_.now(), no_answer_};
}

Statistics LuxLine::statistics() const {
  const auto count = [](std::uint64_t value) { return static_cast<double>(value); };
  return {{"requests", count(requests_)},
          {"replies", count(replies_)},
          {"retries", count(retries_)},
          {"timeouts", count(timeouts_)},
          {"wrong_replies", count(wrong_replies_)},
          {"skipped_bytes", count(skipped_bytes_)},
          {"disconnects", count(disconnects_)},
          {"reconnects", count(reconnects_)}};
}

}  // namespace tankrig
