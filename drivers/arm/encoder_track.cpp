#include "drivers/arm/encoder_track.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tankrig {
namespace {

/// The shorter way round from `b` to `a`.
int way(std::uint16_t a, std::uint16_t b) noexcept {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(a - b));
}

}  // namespace

EncoderTrack::Reading EncoderTrack::take(std::uint16_t raw, Stamp when) noexcept {
  const double since = started_ ? seconds(when - newest().when) : 0;
  const auto moved = std::llround(speed() * since);
  const int off = std::abs(way(raw, static_cast<std::uint16_t>(raw_ + moved)));
  const bool reachable = started_ && off <= settings_.jump_ticks + settings_.max_ticks_per_s * since;
  if (reachable && (raw != 0 || std::min(off, std::abs(way(raw, raw_))) <= kFalseZero)) {
    accept(raw, when);
    return Reading::kGood;
  }
  if (!agrees(raw, when)) {
    agreeing_ = 0;
    reachable_ = reachable;
  }
  ++agreeing_;
  candidate_ = raw;
  candidate_when_ = when;
  if (agreeing_ >= settings_.persists_samples) {
    if (reachable_) {
      accept(raw, when);
      return Reading::kGood;
    }
    const bool jumped = started_;
    anchor(raw, when);
    return jumped ? Reading::kJumped : Reading::kGood;
  }
  return started_ ? Reading::kRejected : Reading::kStarting;
}

bool EncoderTrack::agrees(std::uint16_t raw, Stamp when) const noexcept {
  return agreeing_ > 0 && std::abs(way(raw, candidate_)) <=
                              settings_.jump_ticks + settings_.max_ticks_per_s * seconds(when - candidate_when_);
}

void EncoderTrack::accept(std::uint16_t raw, Stamp when) noexcept {
  const std::int32_t believed = newest().ticks + way(raw, raw_);
  raw_ = raw;
  agreeing_ = 0;
  const std::int32_t settled = std::clamp(newest().settled, believed - kWaver, believed + kWaver);
  past_[static_cast<std::size_t>(count_++ % kPast)] = {believed, settled, when};
}

void EncoderTrack::anchor(std::uint16_t raw, Stamp when) noexcept {
  started_ = true;
  raw_ = raw;
  agreeing_ = 0;
  const std::int32_t ticks = way(raw, zero_);
  past_[0] = {ticks, ticks, when};
  count_ = 1;
}

void EncoderTrack::restart() noexcept {
  started_ = false;
  agreeing_ = 0;
  count_ = 0;
}

void EncoderTrack::set_zero(std::uint16_t raw) noexcept {
  zero_ = raw;
  if (started_) anchor(raw_, newest().when);
}

double EncoderTrack::speed() const noexcept {
  if (count_ < 2) return 0;
  const std::int64_t oldest = std::max<std::int64_t>(0, count_ - kPast);
  std::int64_t n = std::max(oldest, count_ - 6);
  const auto at = [&](std::int64_t i) -> const Past& { return past_[static_cast<std::size_t>(i % kPast)]; };
  while (n > oldest && newest().when - at(n).when < kSpan) --n;
  const double t = seconds(newest().when - at(n).when);
  return t > 0 ? (newest().settled - at(n).settled) / t : 0;
}

}  // namespace tankrig
