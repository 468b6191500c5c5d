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
  const double believable = std::max<double>(settings_.jump_ticks, settings_.max_ticks_per_s * since);
  if (started_ && std::abs(way(raw, raw_)) <= believable) {
    accept(raw, when);
    return Reading::kGood;
  }
  const bool agrees = agreeing_ > 0 && std::abs(way(raw, candidate_)) <= settings_.jump_ticks;
  candidate_ = raw;
  agreeing_ = agrees ? agreeing_ + 1 : 1;
  if (agreeing_ >= settings_.persists_samples) {
    const bool jumped = started_;
    anchor(raw, when);
    return jumped ? Reading::kJumped : Reading::kGood;
  }
  if (!started_) return Reading::kStarting;
  ticks_ = newest().ticks + static_cast<std::int32_t>(std::lround(speed() * since));
  return Reading::kRejected;
}

void EncoderTrack::accept(std::uint16_t raw, Stamp when) noexcept {
  const std::int32_t believed = newest().ticks + way(raw, raw_);
  raw_ = raw;
  ticks_ = believed;
  agreeing_ = 0;
  const std::int32_t settled = std::clamp(newest().settled, believed - kWaver, believed + kWaver);
  past_[static_cast<std::size_t>(count_++ % kPast)] = {believed, settled, when};
}

void EncoderTrack::anchor(std::uint16_t raw, Stamp when) noexcept {
  started_ = true;
  raw_ = raw;
  ticks_ = way(raw, zero_);
  agreeing_ = 0;
  past_[0] = {ticks_, ticks_, when};
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
