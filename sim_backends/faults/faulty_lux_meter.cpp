#include "sim_backends/faults/faulty_lux_meter.hpp"

#include <algorithm>
#include <cerrno>

namespace tankrig::sim {

Result<LuxReading> FaultyLuxMeter::read(Duration timeout) {
  const Stamp now = clock_.now();
  const auto active = [&](FaultKind kind) { return script_.active(FaultDevice::kLuxMeter, kind, now); };
  if (active(FaultKind::kUnplugged)) return Error{ErrorCode::kDisconnected, ENODEV, now, "lux meter: line lost"};
  const FaultSpec* slow = active(FaultKind::kSlow);
  const bool mute = active(FaultKind::kOff) || script_.off_now(FaultDevice::kLuxMeter, now);
  if (slow || mute) clock_.sleep_until(now + (mute ? timeout : std::min(slow->delay, timeout)));
  if (mute || (slow && slow->delay > timeout)) return Error{ErrorCode::kTimeout, 0, now, "lux meter: no answer"};
  if (active(FaultKind::kGarbage) || active(FaultKind::kTorn))
    return Error{ErrorCode::kProtocol, 0, now, "lux meter: wrong answer"};
  auto reading = meter_.read(timeout);
  if (!reading.ok()) return reading;
  if (active(FaultKind::kStuck) && last_) reading.value().lux = *last_;
  last_ = reading.value().lux;
  if (const FaultSpec* wrong = active(FaultKind::kWrong)) reading.value().lux *= 1 + wrong->amount;
  return reading;
}

}  // namespace tankrig::sim
