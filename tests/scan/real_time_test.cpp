// The same scan on the real clock: the cycle in a thread of its own, whatever its supervisor does.
#include <gtest/gtest.h>

#include <thread>

#include "core/input_error.hpp"
#include "session/recording/event_kinds.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/mock_rig.hpp"
#include "tests/support/slow_camera.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// A scan of about three seconds.
struct ShortRig : testing_support::MockRigUnder<MonotonicClock> {
  ShortRig() {
    s.park << 0, 0.12, 1.3, 0, 0.1;
    s.sweep.from = 1.35;
    s.sweep.to = 1.45;
    s.capture.dark_frames = 2;
    s.move.settle = 0.1;
    s.capture.laser_warm_up = 0.2;
    s.real_time.required = false;
    s.real_time.overruns = 0;
    s.control.following_error_limit = 0.5;  // how late a busy machine's cycles are is not what is tested here
    s.control.feedback_timeout = 5;
    mock.laser_warm_up = 200ms;
    mock.arm.watchdog = 10s;
  }
};

TEST(RealTimeScan, RecordsTheSweepAndEndsSafe) {
  ShortRig rig;
  rig.s.control.heartbeat_timeout = 5;
  testing_support::MachineWitness witness;
  const ScanResult result = rig.run();
  EXPECT_EQ(result.status, "complete");
  EXPECT_TRUE(result.left.safe());
  ASSERT_TRUE(result.times);
  EXPECT_EQ(result.times->wake_up.count(), result.times->cycles);
  const double points = static_cast<double>(result.times->cycles + result.times->missed_cycles);
  EXPECT_GE(points, rig.plan->duration() * rig.s.cycle_hz);
  TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkBefore).size(), 2u);
  EXPECT_NEAR(static_cast<double>(rig.sink.of("mono", Phase::kSweep).size()), 25, 1);
}

TEST(RealTimeScan, IsRefusedBeforeAnythingMovesWhereTheSystemDoesNotGrantWhatItRequires) {
  ShortRig rig;
  rig.s.real_time.required = true;
  rig.s.real_time.cpu = 1023;
  EXPECT_THROW(rig.run(), InputError);
  EXPECT_TRUE(rig.sink.states.empty());
  EXPECT_TRUE(rig.sink.events.empty());
}

TEST(RealTimeScan, TellsWhatTheSystemDoesNotGrantWhereItGoesWithoutIt) {
  ShortRig rig;
  rig.s.real_time.cpu = 1023;
  rig.stop = true;
  rig.run();
  ASSERT_FALSE(rig.sink.events.empty());
  EXPECT_EQ(rig.sink.events[0].kind, event_kind::kRealTime);
  EXPECT_NE(rig.sink.events[0].text.find("processor 1023"), std::string::npos) << rig.sink.events[0].text;
}

TEST(RealTimeScan, LightsTheSweepOfACameraThatIsSlowToStart) {
  ShortRig rig;
  rig.s.control.heartbeat_timeout = 5;
  rig.power_on();
  rig.plan = std::make_unique<ScanPlan>(make_scan_plan(rig.s, read_posture(*rig.arm, rig.clock, 1s)));
  testing_support::SlowCamera mono(*rig.cameras[0], rig.clock, 100ms);
  ScanJob job{*rig.plan, rig.s,    rig.clock,          *rig.arm, *rig.laser, {{&mono, RecordWhen::kAll}},
              rig.sink,  rig.stop, [] { return true; }};
  testing_support::MachineWitness witness;
  const ScanResult result = run_scan(job);
  EXPECT_EQ(result.status, "complete");
  TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  EXPECT_NEAR(static_cast<double>(rig.sink.of("mono", Phase::kSweep).size()), 25, 1);
}

TEST(RealTimeScan, DropsTheBeamWhileItsSupervisorHangs) {
  ShortRig rig;
  rig.s.control.heartbeat_timeout = 1;
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
  rig.s.control.heartbeat_timeout = 5;
  rig.sink.throw_at = 4;
  EXPECT_THROW(rig.run(), std::runtime_error);
  EXPECT_TRUE(rig.left.safe());
  EXPECT_FALSE(rig.laser->state().value().powered);
}

}  // namespace
}  // namespace tankrig
