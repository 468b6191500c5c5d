// Counts every operator new of the test program.
#pragma once

#include <cstdint>

namespace tankrig::testing_support {

std::uint64_t allocations() noexcept;

}  // namespace tankrig::testing_support
