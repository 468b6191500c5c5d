// Whether a scan left the rig safe: laser read back dark, arm measured at rest.
#pragma once

#include <optional>
#include <string>

#include "rig/executive/cycle_record.hpp"
#include "rig/safety/rest_watch.hpp"
#include "rig/safety/safety_settings.hpp"
#include "rig/safety/still_watch.hpp"

namespace tankrig {

/// What the devices confirmed after the end, not what was commanded.
struct EndState {
  bool laser_dark = false;   ///< Laser::state() was read: dark()
  bool arm_at_rest = false;  ///< measured velocities have been below creep for a while, and still are measured

  bool safe() const noexcept { return laser_dark && arm_at_rest; }
  bool operator==(const EndState&) const = default;
};

/// "laser off, arm at rest", or for each that is not confirmed what the people at the tank must do.
std::string to_string(const EndState& left);
/// Only what must be cut, in the same words; empty if both are confirmed.
std::string to_cut(const EndState& left);

/// Watches the cycle's records from the end of the plan, a stop or a fault on.
/// Threads: one.
class SafeEnd {
 public:
  static constexpr Duration kNewsAge = StillWatch::kNewsAge;
  /// By then an obedient laser is dark and an obedient arm at rest.
  static constexpr Duration kUsual = std::chrono::seconds{1};

  explicit SafeEnd(const SafetySettings& settings) : settings_(settings), rest_(settings.rest_velocity) {}

  /// Records in order of their stamps.
  void add(const CycleRecord& record);

  /// The executive has ended: done, stopped or in fault.
  bool ended() const noexcept { return ended_at_.has_value(); }
  /// Ended, and both confirmed, or rest_timeout has passed.
  bool settled() const noexcept;
  EndState left() const noexcept { return left_; }
  /// Confirmed, or soon to be: the stop was accepted, the device answers, and kUsual has not passed.
  EndState expected() const noexcept { return expected_; }

 private:
  const SafetySettings settings_;
  std::optional<Stamp> ended_at_;
  RestWatch rest_;  // of joint samples after the end
  Stamp now_{}, news_{};
  std::optional<Stamp> heard_;  // the arm, before the end too
  EndState left_, expected_{true, true};
};

}  // namespace tankrig
