// What is asked of whoever stands at the tank.
#pragma once

#include <cstdint>

namespace tankrig {

enum class Deed : std::uint8_t { kOpenLid, kCloseLid, kPressStop, kReleaseStop };

}  // namespace tankrig
