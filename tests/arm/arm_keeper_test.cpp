// How the arm driver's own thread asks for the processor.
#include <gtest/gtest.h>

#include <thread>

#include "core/thread_priority.hpp"
#include "rig/platform/real_time_settings.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/named_thread.hpp"

namespace tankrig {
namespace {

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

}  // namespace
}  // namespace tankrig
