// Whether the guardian watches, makes safe or ends, decided in each of its rounds.
#pragma once

#include <cstdint>
#include <type_traits>

#include "core/time.hpp"

namespace tankrig {

/// What the guardian knows when it asks.
struct GuardianInputs {
  Stamp now{};
  std::uint64_t steps = 0;    ///< completed safety steps of the program
  bool watched = false;       ///< the program may move or shine: it must go on completing steps
  bool gone = false;          ///< the program has ended
  bool confirmed = false;     ///< the devices say: laser off, arm at rest
  bool acknowledged = false;  ///< an operator said that the power is cut
  Duration patience{};        ///< longest time between two steps
};

struct GuardianState {
  bool taken_over = false;
  bool watched = false;  ///< in the round before
  std::uint64_t steps = 0;
  Stamp looked{};      ///< the round before
  Duration stalled{};  ///< the steps have stood still for so long, as far as the guardian was there to see
};
static_assert(std::is_trivially_copyable_v<GuardianState>);

enum class GuardianAct : std::uint8_t { kWatch, kMakeSafe, kEnd };

struct GuardianStep {
  GuardianState state;
  GuardianAct act = GuardianAct::kWatch;
};

/// A guardian that got no processor saw nothing meanwhile: one round adds at most this to the stall.
inline constexpr Duration kLongestLook = std::chrono::milliseconds{10};

// clang-format off
/// The first row that applies. "-": any; "stalled": watched, now and in the round before, without a new step for longer
/// than patience; "settled": confirmed or acknowledged.
///
///   | taken over | gone | watched stalled | settled | -> taken over | act       |
///   | yes        | yes  | -       -       | yes     | -> yes        | end       |
///   | yes        | -    | -       -       | -       | -> yes        | make safe |  also while the program is there: it may wake up
///   | no         | yes  | yes     -       | -       | -> yes        | make safe |  it died in motion, or before rest was confirmed
///   | no         | yes  | no      -       | -       | -> no         | end       |  an orderly end
///   | no         | no   | yes     yes     | -       | -> yes        | make safe |
///   | no         | no   | -       -       | -       | -> no         | watch     |
///
/// Taken over is for good: the program finds it and ends.
/// RT: safe.
// clang-format on
GuardianStep step(const GuardianState& state, const GuardianInputs& in) noexcept;

}  // namespace tankrig
