#include "drivers/arm/arm_encoders.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tankrig {

ArmEncoders::ArmEncoders(const Arm5eSettings& settings) : evidence_(settings.silence_timeout) {
  tracks_.fill(EncoderTrack(settings.encoder));
}

void ArmEncoders::demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept {
  for (std::size_t j = 0; j < kJoints; ++j)
    evidence_.demand(j, static_cast<int>(std::min<double>(std::abs(ticks_per_s[j]), kLargestSpeed)), now);
}

ArmEncoders::Doubts ArmEncoders::take(const ArmReadings& readings, const ArmExchange& has, bool stalled) noexcept {
  Doubts doubts;
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (!holds(has.sensors, j)) continue;
    switch (tracks_[j].take(readings.raw[j], readings.stamp)) {
      case EncoderTrack::Reading::kRejected:
        ++doubts.rejected;
        break;
      case EncoderTrack::Reading::kJumped:
        ++doubts.jumped;
        break;
      case EncoderTrack::Reading::kStarting:
        break;
      case EncoderTrack::Reading::kGood:
        evidence_.read(j, tracks_[j].raw(), readings.stamp, stalled);
        break;
    }
  }
  return doubts;
}

void ArmEncoders::restart() noexcept {
  for (EncoderTrack& track : tracks_) track.restart();
}

void ArmEncoders::set_zero(const std::array<std::uint16_t, kJoints>& raw) noexcept {
  for (std::size_t j = 0; j < kJoints; ++j) tracks_[j].set_zero(raw[j]);
}

bool ArmEncoders::started() const noexcept {
  return std::all_of(tracks_.begin(), tracks_.end(), [](const EncoderTrack& t) { return t.started(); });
}

std::array<std::uint16_t, kJoints> ArmEncoders::raw() const noexcept {
  std::array<std::uint16_t, kJoints> raw;
  for (std::size_t j = 0; j < kJoints; ++j) raw[j] = tracks_[j].raw();
  return raw;
}

std::array<double, kJoints> ArmEncoders::ticks() const noexcept {
  std::array<double, kJoints> ticks;
  for (std::size_t j = 0; j < kJoints; ++j) ticks[j] = tracks_[j].ticks();
  return ticks;
}

JointState ArmEncoders::state(const ArmModel& model, const ArmReadings& readings, bool homed) const noexcept {
  constexpr double kNoAngle = std::numeric_limits<double>::quiet_NaN();
  JointState state;
  state.stamp = readings.stamp;
  state.current_a = readings.current_a;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const int row = static_cast<int>(j);
    const Actuator& actuator = model.actuators[j];
    state.age[j] = state.stamp - tracks_[j].when();
    state.ticks[j] = tracks_[j].ticks();
    state.q[row] = homed ? actuator.angle(state.ticks[j]) : kNoAngle;
    state.velocity[row] = homed ? tracks_[j].speed() * signed_slope(actuator, state.ticks[j]) : kNoAngle;
  }
  return state;
}

}  // namespace tankrig
