#include "drivers/arm/arm_faults.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

namespace tankrig {
namespace {

bool ends_with_homing(ArmFault fault) noexcept { return fault == ArmFault::kEncoder || fault == ArmFault::kPosture; }

Error error_of(ArmFault fault, Stamp now) noexcept {
  switch (fault) {
    case ArmFault::kOverCurrent:
      return {ErrorCode::kOverCurrent, 0, now, "arm: over-current for too long"};
    case ArmFault::kWater:
      return {ErrorCode::kOutOfRange, 0, now, "arm: water in a joint's housing"};
    case ArmFault::kEncoder:
      return {ErrorCode::kNotReady, 0, now, "arm: an encoder lost its reference, home again"};
    case ArmFault::kPosture:
      return {ErrorCode::kNotReady, 0, now, "arm: a joint outside its limits, home again"};
    case ArmFault::kSuspended:
      return {ErrorCode::kRefused, 0, now, "arm: stopped, the machine was suspended"};
    case ArmFault::kNone:
      break;
  }
  return {ErrorCode::kInternal, 0, now, "arm: no fault"};
}

bool turns_without_end(const JointLimit& limit) noexcept {
  return limit.upper - limit.lower > 2 * std::numbers::pi - 1e-6;
}

}  // namespace

bool outside_limits(const ArmModel& model, const JointVector& q, double margin) noexcept {
  for (int j = 0; j < kJoints; ++j) {
    const JointLimit& limit = model.limits[static_cast<std::size_t>(j)];
    if (turns_without_end(limit)) continue;
    if (!(q[j] >= limit.lower - margin && q[j] <= limit.upper + margin)) return true;
  }
  return false;
}

ArmFault ArmFaults::seen_in(const ArmReadings& readings) noexcept {
  const bool drawing = current_.step(settings_.over_current, readings.stamp, readings.current_a);
  const bool wet = std::any_of(readings.water.begin(), readings.water.end(),
                               [this](std::uint8_t raw) { return raw >= settings_.water_ingress_raw; });
  if (wet) return ArmFault::kWater;
  return drawing ? ArmFault::kOverCurrent : ArmFault::kNone;
}

bool ArmFaults::raise(ArmFault fault) noexcept {
  if (fault == ArmFault::kNone || fault_ != ArmFault::kNone) return false;
  fault_ = fault;
  told_ = false;
  return true;
}

std::optional<Error> ArmFaults::tell(Stamp now) noexcept {
  if (std::exchange(told_, true)) return {};
  return error_of(fault_, now);
}

Status ArmFaults::refusal(Stamp now, bool homing) const noexcept {
  if (fault_ == ArmFault::kNone || (homing && ends_with_homing(fault_))) return {};
  return error_of(fault_, now);
}

void ArmFaults::reference_found() noexcept {
  if (!ends_with_homing(fault_)) return;
  fault_ = ArmFault::kNone;
  told_ = true;
}

}  // namespace tankrig
