// What the cycle calls of the laser's driver takes no memory.
#include <gtest/gtest.h>

#include "drivers/laser/relay_laser.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/counting_new.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::allocations;

TEST(RelayLaser, SettingAndReadingStateAllocateNothing) {
  TANKRIG_SKIP_SANITIZED(testing_support::kNoCounting);
  TemporaryFolder folder;
  MonotonicClock clock;
  sim::MockLaser lamp(1ms, clock);
  sim::RelayEmulator emulator({.name = folder.path() / "laser"}, lamp);
  RelayLaser laser({.serial = {.device = (folder.path() / "laser").string(), .baud = 9600}, .opening_timeout = 10s});
  const std::uint64_t counted = allocations();
  ::operator delete(::operator new(1));
  ASSERT_GT(allocations(), counted) << "the counter works";
  const std::uint64_t before = allocations();
  for (int i = 0; i < 1000; ++i) {
    const bool taken = (i % 2 == 0 ? BenchRight::light(laser) : laser.off()).ok();
    const bool known = laser.state().ok();
    ASSERT_TRUE(taken && known);
  }
  emulator.unplug();
  const std::uint64_t unplugged = allocations();
  bool refused = false;
  wait_until([&] { return refused = !BenchRight::light(laser).ok() && !laser.state().ok(); });
  EXPECT_TRUE(refused);
  EXPECT_EQ(allocations(), unplugged);
  EXPECT_EQ(unplugged, before);
}

}  // namespace
}  // namespace tankrig
