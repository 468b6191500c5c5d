// The relay's driver on a machine that was suspended: off, whatever its caller believes.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/serial/relay_box.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/sleepy_clock.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using namespace testing_support;
using sim::RelayEmulator;
using ::testing::Each;

TEST(RelayLaserOnAMachineThatSleeps, SendsOffAndNoOnAgainThoughNoTimeOutSawIt) {
  for (const bool with_status : {false, true}) {
    SCOPED_TRACE(with_status ? "with status" : "without status");
    Box box;
    if (with_status) box.with_status();
    SleepyClock clock;
    RelayEmulator& emulator = box.start();
    RelayLaser laser(box.settings, clock);
    ASSERT_TRUE(BenchRight::light(laser).ok());
    ASSERT_TRUE(reaches(laser, true));
    emulator.take_received();
    clock.suspend(8h);
    ASSERT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "on was sent again";
    ASSERT_TRUE(recovers(laser));
    EXPECT_FALSE(laser.state().value().commanded) << "it stays off until somebody switches it on again";
    const double queries = count(laser, "queries"), refreshes = count(laser, "refreshes");
    ASSERT_TRUE(wait_until([&] {
      return count(laser, "refreshes") > refreshes + 2 && (!with_status || count(laser, "queries") > queries + 2);
    }));
    const auto bytes = emulator.take_received();
    const auto off = std::find(bytes.begin(), bytes.end(), 2);
    ASSERT_NE(off, bytes.end());
    EXPECT_EQ(std::count(off, bytes.end(), 1), 0) << "on after off";
    EXPECT_EQ(count(laser, "latched_off"), 1);
    ASSERT_TRUE(BenchRight::light(laser).ok()) << "by an edge of its own";
    EXPECT_TRUE(reaches(laser, true));
  }
}

/// The box does not answer any more, so what is told stays to be seen.
TEST(RelayLaserOnAMachineThatSleeps, TellsItsCallerAndRefusesToSwitchOnUntilOffIsConfirmed) {
  Box box;
  box.settings.answer_timeout = 2s;
  SleepyClock clock;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings, clock);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.set_fault(sim::RelayFault::kSilent);
  clock.suspend(2s);
  ASSERT_TRUE(fails_with(laser, ErrorCode::kSuspended));
  const Status refused = BenchRight::light(laser);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(describe(refused.error()), "laser relay: switch on: the machine was suspended");
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "off is sent although nothing answers";
}

}  // namespace
}  // namespace tankrig
