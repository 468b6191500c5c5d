// How a camera is triggered: the rig file's `trigger` keys of a camera.
#pragma once

#include <cstdint>
#include <optional>

#include "core/enum_names.hpp"
#include "core/time.hpp"

namespace tankrig {

enum class TriggerMode : std::uint8_t {
  kFree,      ///< at its own rate
  kSoftware,  ///< by trigger(), at equal times
  kPosition,  ///< by trigger(), at equal angles of the elbow while it sweeps, at equal times while the arm rests
};
template <>
inline constexpr std::array kNames<TriggerMode>{"free", "software", "position"};

struct TriggerSettings {
  TriggerMode mode = TriggerMode::kFree;
  double spacing = 0;             ///< of kPosition, > 0 [rad]
  std::optional<Duration> delay;  ///< from trigger() to mid-exposure; nothing: measured as frames come
};

}  // namespace tankrig
