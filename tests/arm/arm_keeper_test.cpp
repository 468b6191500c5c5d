// The arm driver's own thread: its priority, and what it does for an arm that its caller has left.
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "core/thread_priority.hpp"
#include "drivers/arm/can_arm_link.hpp"
#include "rig/platform/real_time_settings.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/named_thread.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

TEST(ArmKeeper, KeepsTimeJustBelowTheCycle) {
  bool granted = false;
  std::thread([&] { granted = set_fifo("asks", 1); }).join();
  if (!granted) GTEST_SKIP() << "this machine does not grant SCHED_FIFO";
  sim::testing_support::ArmBench bench;
  bench.make();
  std::optional<int> priority;
  EXPECT_TRUE(bench.until([&] { return (priority = testing_support::fifo_priority("arm-keeper")).has_value(); }));
  EXPECT_EQ(priority, RealTimeSettings{}.priority - 3);
}

/// Its caller hangs outside the driver. The stop may be lost, and the arm may be mute to it.
TEST(ArmKeeper, AsksAnArmThatWasLeftToRestInTwoWaysByTurnsUntilSomebodyListens) {
  MonotonicClock clock;
  auto [near, far] = make_can_pair(clock);
  Arm5eSettings settings;
  settings.watchdog = 100ms;
  Arm5e arm(settings, arm5e(), std::make_unique<CanArmLink>(std::move(near), settings.can_ids, 500'000), clock);
  arm.set_zero({});
  std::vector<DemandSlot> seen;  // by the joint whose demand is altered
  const auto look = [&] {
    while (true) {
      const auto frame = far->try_receive();
      if (!frame.ok() || !frame.value()) return;
      if (frame.value()->id == settings.can_ids.demand[kJawRotate]) seen.push_back(decode_demand(frame.value()->data));
    }
  };
  const auto asked = [&] {
    look();
    return seen.size() > 8;
  };
  ASSERT_TRUE(drive_ticks(arm, {0, 0, 400, 0, 0}).ok());
  for (const Stamp end = clock.now() + 10s; !asked() && clock.now() < end;) clock.sleep_until(clock.now() + 5ms);
  ASSERT_GT(seen.size(), 8u);
  for (std::size_t i = seen.size() - 5; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i].type, DemandType::kStop);
    EXPECT_NE(seen[i].speed_limit, seen[i - 1].speed_limit);
  }
  (void)arm.try_read();
  clock.sleep_until(clock.now() + 100ms);  // a round that had begun
  look();
  const std::size_t before = seen.size();
  clock.sleep_until(clock.now() + 300ms);
  look();
  EXPECT_EQ(seen.size(), before);
}

}  // namespace
}  // namespace tankrig
