// The same scan on the real clock: the cycle in a thread of its own, whatever its supervisor does.
#include <gtest/gtest.h>

#include <thread>

#include "tests/executive/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// A scan of about three seconds.
struct ShortRig : testing_support::MockRigUnder<MonotonicClock> {
  ShortRig() {
    s.park << 0, 0.12, 1.3, 0, 0.1;
    s.sweep_from = 1.35;
    s.sweep_to = 1.45;
    s.dark_frames = 2;
    s.settle = 0.1;
    s.laser_warm_up = 0.2;
    s.following_error_limit = 0.5;  // how late a busy machine's cycles are is not what is tested here
    s.feedback_timeout = 5;
    mock.laser_warm_up = 200ms;
    mock.arm.watchdog = 10s;
  }
};

TEST(RealTimeScan, RecordsTheSweepAndEndsSafe) {
  ShortRig rig;
  rig.s.heartbeat_timeout = 5;
  const ScanResult result = rig.run();
  EXPECT_EQ(result.status, "complete");
  EXPECT_TRUE(result.left.safe());
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkBefore).size(), 2u);
  EXPECT_GT(rig.sink.of("mono", Phase::kSweep).size(), 15u);
}

TEST(RealTimeScan, DropsTheBeamWhileItsSupervisorHangs) {
  ShortRig rig;
  rig.s.heartbeat_timeout = 1;
  bool dropped_meanwhile = false;
  rig.sink.on_frame = [&](const FrameRecord& frame) {
    if (frame.phase != Phase::kSweep || dropped_meanwhile) return;
    const Stamp deadline = rig.clock.now() + 20s;
    while (!dropped_meanwhile && rig.clock.now() < deadline) {
      std::this_thread::yield();
      dropped_meanwhile = !rig.laser->state().value().powered;
    }
  };
  const ScanResult result = rig.run();
  EXPECT_TRUE(dropped_meanwhile);
  EXPECT_NE(result.status.find("heartbeat late"), std::string::npos) << result.status;
  EXPECT_TRUE(result.left.safe());
}

TEST(RealTimeScan, EndsSafeWhenItsSinkThrows) {
  ShortRig rig;
  rig.s.heartbeat_timeout = 5;
  rig.sink.throw_at = 4;
  EXPECT_THROW(rig.run(), std::runtime_error);
  EXPECT_TRUE(rig.left.safe());
  EXPECT_FALSE(rig.laser->state().value().powered);
}

}  // namespace
}  // namespace tankrig
