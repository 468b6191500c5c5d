// The pace of emulated wires, kept beside a renderer that takes every processor it gets.
#pragma once

#include "core/thread_priority.hpp"

namespace tankrig::sim {

inline constexpr int kEmulatedWirePriority = 40;

}  // namespace tankrig::sim
