// The arm inside the cycle: nothing is allocated, and faults of its wire reach the executive's record.
#include <gtest/gtest.h>

#include <functional>
#include <thread>
#include <utility>

#include "rig/executive/executive.hpp"
#include "rig/executive/safe_end.hpp"
#include "rig/plan/operator_plan.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/counting_new.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig::sim {
namespace {

using tankrig::testing_support::allocations;
using tankrig::testing_support::CallLog;
using tankrig::testing_support::FakeLaser;
using testing_support::ArmBench;
using testing_support::elbow;
using testing_support::Wire;
using namespace std::chrono_literals;

class ArmCycleOn : public ::testing::TestWithParam<Wire> {};
INSTANTIATE_TEST_SUITE_P(Each, ArmCycleOn, ::testing::ValuesIn(testing_support::kWires), testing_support::wire_name);

TEST_P(ArmCycleOn, AllocatesNothing) {
  TANKRIG_SKIP_SANITIZED(tankrig::testing_support::kNoCounting);
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  const std::uint64_t before = allocations();
  int states = 0, failures = 0;
  const JointVector velocity = elbow(0.1);
  for (const Stamp end = bench.clock.now() + 10s; states < 30 && bench.clock.now() < end;) {
    const auto news = bench.arm->try_read();
    failures += !news.ok();
    states += news.ok() && news.value();
    failures += !drive(*bench.arm, velocity).ok();
    if (states % 10 == 9) failures += !bench.arm->stop().ok();
    bench.clock.sleep_until(bench.clock.now() + 5ms);
  }
  EXPECT_EQ(allocations(), before);
  EXPECT_EQ(failures, 0);
  EXPECT_GE(states, 30);
  ::operator delete(::operator new(1));
  EXPECT_EQ(allocations(), before + 1) << "the counter does not count";
}

/// The executive on a real driver, on an emulated arm that can be made to fail.
struct ExecutiveBench {
  ArmBench arm;
  ScanSettings scan;
  ScanPlan plan;
  CallLog log;
  FakeLaser laser{log};
  std::optional<Executive> executive;
  CycleRecord last;

  static ScanSettings settings(const JointVector& park) {
    ScanSettings s;
    s.park = s.posture = park;
    s.sweep.from = park[kElbow] + 0.1;
    s.sweep.to = park[kElbow] + 0.3;
    s.capture.dark_frames = 2;
    s.capture.laser_warm_up = 0.1;
    s.control.feedback_timeout = s.control.heartbeat_timeout = 5;  // the driver's own silence is to be seen
    s.control.following_error_limit = 1;                           // and nothing that a busy machine does to the motion
    return s;
  }

  explicit ExecutiveBench(Wire wire)
      : arm(wire), scan(settings(arm.parameters.power_up)), plan(make_scan_plan(scan, scan.park)) {}

  void begin(bool homed = true) {
    arm.make(homed);
    arm.state();
    executive.emplace(plan, scan, *arm.arm, laser);
    executive->set_interlock(true);
    cycle();
    executive->set_armed(true);
    executive->start(arm.clock.now() + 5ms);
  }
  void cycle() {
    const Stamp now = arm.clock.now();
    executive->heartbeat(now);
    executive->step(now);
    while (executive->try_pop(last)) continue;
  }
  bool until(const std::function<bool()>& end) {
    return arm.until([&] {
      cycle();
      return end();
    });
  }
  bool moving() {
    return until([&] { return arm.emulator->true_velocity_at(arm.clock.now())[kElbow] > 0.05; });
  }
  void expect_fault(Fault fault, const char* where) {
    ASSERT_TRUE(until([&] { return last.state == ExecutiveState::kFault; }));
    EXPECT_EQ(last.fault, fault) << to_string(last.fault);
    EXPECT_STREQ(last.error.where, where);
    EXPECT_FALSE(laser.on());
  }
  void expect_rest() {
    EXPECT_TRUE(until([&] { return arm.emulator->true_velocity_at(arm.clock.now())[kElbow] == 0; }));
  }
};

TEST_P(ArmCycleOn, TheExecutiveStopsOnASilentArm) {
  ExecutiveBench bench(GetParam());
  bench.begin();
  ASSERT_TRUE(bench.moving());
  bench.arm.emulator->set_faults({.silent = true});
  bench.expect_fault(Fault::kArmRead, "arm: silent");
  EXPECT_EQ(bench.last.error.code, ErrorCode::kTimeout);
  bench.expect_rest();  // it does not answer, but it obeys
}

TEST_P(ArmCycleOn, TheExecutiveStopsOnWater) {
  ExecutiveBench bench(GetParam());
  bench.begin();
  ASSERT_TRUE(bench.moving());
  bench.arm.emulator->set_faults({.water_joint = kShoulder});
  bench.expect_fault(Fault::kArmRead, "arm: water in a joint's housing");
  bench.expect_rest();
}

TEST_P(ArmCycleOn, TheExecutiveTellsOverCurrentAsSuch) {
  ExecutiveBench bench(GetParam());
  bench.arm.settings.over_current.duration = 200ms;
  bench.begin();
  ASSERT_TRUE(bench.moving());
  bench.arm.emulator->set_faults({.extra_current_a = 2.5});
  bench.expect_fault(Fault::kJointCurrent, "arm: over-current for too long");
  bench.expect_rest();
}

TEST_P(ArmCycleOn, TheExecutiveStopsOnStaleReadings) {
  ExecutiveBench bench(GetParam());
  bench.begin();
  ASSERT_TRUE(bench.moving());
  bench.arm.emulator->set_faults({.stale = true});
  bench.expect_fault(Fault::kArmRead, "arm: repeats old readings though it is driven");
  bench.expect_rest();
}

TEST_P(ArmCycleOn, TheExecutiveRefusesAnArmThatIsNotHomed) {
  ExecutiveBench bench(GetParam());
  bench.begin(false);
  bench.expect_fault(Fault::kArmWrite, "arm: not homed");
}

TEST(ArmCycle, TheExecutiveStopsOnAPulledPlug) {
  ExecutiveBench bench(Wire::kPty);
  bench.begin();
  ASSERT_TRUE(bench.moving());
  bench.arm.emulator->unplug();
  bench.expect_fault(Fault::kArmRead, "arm: carrier lost");
  EXPECT_EQ(bench.last.error.code, ErrorCode::kDisconnected);
  bench.expect_rest();  // by the arm's own watchdog
}

/// The coarsest encoder: a tick of it in the time over which speed is measured is six times the speed of rest.
TEST_P(ArmCycleOn, AnArmAtRestIsSeenAtRestThoughAnEncoderWavers) {
  ExecutiveBench bench(GetParam());
  bench.begin();
  ASSERT_TRUE(bench.moving());
  bench.arm.emulator->set_faults({.wavering_joint = kJawRotate});
  bench.executive->request_stop();
  SafetySettings patient;
  patient.rest_timeout = 10;
  SafeEnd end(patient);
  EXPECT_TRUE(bench.until([&] {
    end.add(bench.last);
    return end.settled();
  }));
  EXPECT_EQ(to_string(end.left()), "laser off, arm at rest");
}

/// With light, the arm held at rest.
struct HoldBench : ExecutiveBench {
  explicit HoldBench(Wire wire) : ExecutiveBench(wire) {
    scan.capture.dark_frames = 20;
    plan = make_lit_hold_plan(scan, scan.park, 30);
  }
  bool lit() {
    return until([&] { return laser.on() || last.fault != Fault::kNone; }) && laser.on();
  }
};

TEST_P(ArmCycleOn, AHoldGoesOnThoughAnEncoderWavers) {
  HoldBench bench(GetParam());
  bench.begin();
  bench.arm.emulator->set_faults({.wavering_joint = kJawRotate});
  ASSERT_TRUE(bench.lit()) << to_string(bench.last.fault) << " " << bench.last.error.where;
  int states = 0;
  ASSERT_TRUE(bench.until([&] {
    states += bench.last.has_joints;
    return states >= 100 || bench.last.fault != Fault::kNone;
  }));
  EXPECT_EQ(bench.last.fault, Fault::kNone) << to_string(bench.last.fault) << " " << bench.last.error.where;
  EXPECT_TRUE(bench.last.holding && bench.laser.on());
}

TEST_P(ArmCycleOn, AHoldEndsWhenAJointCreeps) {
  HoldBench bench(GetParam());
  bench.begin();
  ASSERT_TRUE(bench.lit()) << to_string(bench.last.fault) << " " << bench.last.error.where;
  const Stamp begin = bench.arm.clock.now();
  ASSERT_TRUE(bench.until([&] {
    const double crept = 0.02 * seconds(bench.arm.clock.now() - begin);  // rad, as the encoder reads
    bench.arm.emulator->set_faults({.elbow_offset = crept});
    return bench.last.fault != Fault::kNone;
  }));
  EXPECT_EQ(bench.last.fault, Fault::kMovedInHold) << to_string(bench.last.fault) << " " << bench.last.error.where;
  EXPECT_FALSE(bench.laser.on());
}

TEST_P(ArmCycleOn, CountsOnAcrossTheEncodersWrap) {
  ArmBench bench(GetParam());
  bench.parameters.power_up_ticks.fill(
      300);  // the elbow's ticks get fewer as its angle grows; its speed is steady at 0
  bench.make();
  bench.state();
  double last = bench.parameters.power_up[kElbow], backwards = 0;
  ASSERT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    EXPECT_TRUE(news.ok());
    EXPECT_TRUE(drive(*bench.arm, elbow(0.2)).ok());
    if (news.ok() && news.value()) {
      backwards = std::max(backwards, last - news.value()->q[kElbow]);
      last = news.value()->q[kElbow];
    }
    return last > bench.parameters.power_up[kElbow] + 0.05 && bench.arm->readings().raw[kElbow] > 32'768;
  }));
  EXPECT_LT(backwards, 1e-3);
  EXPECT_EQ(bench.statistic("jumps_rejected"), 0);
}

}  // namespace
}  // namespace tankrig::sim
