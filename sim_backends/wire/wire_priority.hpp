// Keeps the pace of emulated wires beside a renderer that uses every processor.
#pragma once

#include "core/thread_priority.hpp"

namespace tankrig::sim {

inline constexpr int kEmulatedWirePriority = 40;

}  // namespace tankrig::sim
