// Counts every operator new of the thread that asks; nothing under a sanitizer, which has operators of its own.
// Link the target counting_new, which replaces them.
#pragma once

#include <cstdint>

namespace tankrig::testing_support {

std::uint64_t allocations() noexcept;

}  // namespace tankrig::testing_support
