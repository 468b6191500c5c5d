#include "tests/support/counting_new.hpp"

#include <cstdlib>
#include <new>

#include "tests/support/sanitizers.hpp"

namespace {
thread_local std::uint64_t t_allocations = 0;
}

#if !TANKRIG_SANITIZED
// GCC sees the inlined malloc of one operator and the free of the other, and takes them for a mismatch.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

void* operator new(std::size_t size) {
  ++t_allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif

std::uint64_t tankrig::testing_support::allocations() noexcept { return t_allocations; }
