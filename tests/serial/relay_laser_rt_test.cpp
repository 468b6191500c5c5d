// What the cycle calls of the laser's driver takes no memory.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "drivers/laser/relay_laser.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

thread_local std::uint64_t allocations = 0;

}  // namespace

#if !TANKRIG_SANITIZED
// GCC sees the inlined malloc of one operator and the free of the other, and takes them for a mismatch.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc{};
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif

namespace tankrig {
namespace {

using namespace std::chrono_literals;

TEST(RelayLaser, SettingAndReadingStateAllocateNothing) {
  TANKRIG_SKIP_SANITIZED(testing_support::kNoCounting);
  TemporaryFolder folder;
  MonotonicClock clock;
  sim::MockLaser lamp(1ms, clock);
  sim::RelayEmulator emulator({.name = folder.path() / "laser"}, lamp);
  RelayLaser laser({.serial = {.device = (folder.path() / "laser").string(), .baud = 9600}, .opening_timeout = 10s});
  const std::uint64_t counted = allocations;
  ::operator delete(::operator new(1));
  ASSERT_GT(allocations, counted) << "the counter works";
  const std::uint64_t before = allocations;
  for (int i = 0; i < 1000; ++i) {
    const bool taken = laser.set(i % 2 == 0).ok();
    const bool known = laser.state().ok();
    ASSERT_TRUE(taken && known);
  }
  emulator.unplug();
  const std::uint64_t unplugged = allocations;
  bool refused = false;
  wait_until([&] { return refused = !laser.set(true).ok() && !laser.state().ok(); });
  EXPECT_TRUE(refused);
  EXPECT_EQ(allocations, unplugged);
  EXPECT_EQ(unplugged, before);
}

}  // namespace
}  // namespace tankrig
