#include "rig/executive/executive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

#include "rig/executive/cycle_grid.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/counting_new.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::CallLog;
using testing_support::FakeArm;
using testing_support::FakeLaser;

ScanSettings settings() {
  ScanSettings s;
  s.park << 0, 0.12, 1.2, 0, 0.1;
  s.posture = s.park;
  s.sweep.from = 1.3;
  s.sweep.to = 1.5;
  s.capture.dark_frames = 2;
  s.capture.laser_warm_up = 0.2;
  s.move.settle = 0.1;
  s.control.feed_forward_lead = 0;  // the fake arm has no lag
  s.safety.indicator_delay = 0.1;   // shorter than the way to the sweep
  s.control.dead_zone.setZero();
  return s;
}

/// An executive, hand-driven every 5 ms, and the last record it left.
struct ExecutiveBench {
  ScanSettings s;
  ScanPlan plan;
  CallLog log;
  FakeArm arm;
  FakeLaser laser;
  Executive sut;
  Stamp now{};
  CycleRecord last;

  explicit ExecutiveBench(const ScanSettings& settings = tankrig::settings())
      : s(settings), plan(make_scan_plan(s, s.park)), arm(log, s.park), laser(log), sut(plan, s, arm, laser) {}

  void cycle(bool heartbeat = true) {
    now = now + 5ms;
    arm.advance(now);
    if (heartbeat) sut.heartbeat(now);
    sut.step(now);
    CycleRecord record;
    while (sut.try_pop(record)) last = record;
  }
  void cycles(int n, bool heartbeat = true) {
    for (int i = 0; i < n; ++i) cycle(heartbeat);
  }
  /// Armed, and running the plan from the next cycle on.
  void go() {
    sut.set_interlock(true);
    cycle();
    sut.set_armed(true);
    sut.start(now + 5ms);
  }
  /// Cycles until the plan's first sweep pass has been running for a while, the laser on.
  void go_sweeping() {
    go();
    for (int i = 0; i < 100000 && !(laser.on() && plan.segments()[last.segment].phase == Phase::kSweep); ++i) cycle();
    cycles(50);
    ASSERT_TRUE(laser.on());
    log.clear();
  }
  void expect_safe(Fault fault) {
    EXPECT_EQ(last.state, ExecutiveState::kFault);
    EXPECT_EQ(last.fault, fault) << to_string(last.fault);
    EXPECT_FALSE(laser.on());
    EXPECT_EQ(arm.velocity(), JointVector::Zero());
    EXPECT_LT(log.first("laser off"), log.first("stop")) << "the laser goes off first";
    EXPECT_LT(log.first("stop"), log.count);
  }
};

TEST(Executive, RestsWithLaserOffUntilThePlanStarts) {
  ExecutiveBench bench;
  bench.cycle();
  bench.sut.set_armed(true);
  bench.cycles(100);
  EXPECT_EQ(bench.last.state, ExecutiveState::kWaiting);
  EXPECT_EQ(bench.arm.velocity(), JointVector::Zero());
  EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
}

TEST(Executive, FollowsThePlanToItsEnd) {
  ExecutiveBench bench;
  bench.go();
  double worst = 0;
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) {
    bench.cycle();
    worst = std::max(worst, bench.last.following_error);
  }
  EXPECT_EQ(bench.last.state, ExecutiveState::kDone);
  EXPECT_LT(worst, 2e-3);
  EXPECT_FALSE(bench.laser.on());
  EXPECT_EQ(bench.arm.velocity(), JointVector::Zero());
}

TEST(Executive, NeverAsksForASpeedInTheDeadZone) {
  ScanSettings s = settings();
  s.control.dead_zone = ScanSettings().control.dead_zone;
  ExecutiveBench bench(s);
  bench.go();
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) {
    bench.cycle();
    for (int j = 0; j < kJoints; ++j) {
      const double speed = std::abs(bench.last.desired[j]);
      EXPECT_TRUE(speed == 0 || speed >= s.control.dead_zone[j])
          << kJointNames[static_cast<std::size_t>(j)] << " " << speed;
    }
  }
  EXPECT_EQ(bench.last.state, ExecutiveState::kDone);
}

TEST(Executive, HasTheLaserOnInExactlyTheSegmentsThatAskForIt) {
  ExecutiveBench bench;
  bench.go();
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) {
    bench.cycle();
    const bool running = bench.last.state == ExecutiveState::kRunning;
    EXPECT_EQ(bench.laser.on(), running && bench.plan.segments()[bench.last.segment].laser);
  }
}

TEST(Executive, NeverLightsTheLaserUnarmed) {
  ExecutiveBench bench;
  bench.go();
  bench.sut.set_armed(false);
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) bench.cycle();
  EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
}

TEST(Executive, PairsFramesByLightingEverySecondFramePeriod) {
  ScanSettings s = settings();
  s.capture.laser_pairs = s.capture.laser_switches_per_frame = true;
  s.capture.laser_warm_up = 0;
  ExecutiveBench bench(s);
  bench.go();
  std::set<bool> seen;
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) {
    bench.cycle();
    if (bench.plan.segments()[bench.last.segment].phase != Phase::kSweep) continue;
    const auto frame = static_cast<std::int64_t>(std::floor(bench.last.plan_time / s.capture.frame_period + 0.5));
    EXPECT_EQ(bench.laser.on(), frame % 2 == 0);
    seen.insert(bench.laser.on());
  }
  EXPECT_EQ(seen.size(), 2u);
}

TEST(Executive, TakesTheLaserOffBeforeItStopsTheArmWhenAskedToStop) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.sut.request_stop();
  bench.cycle();
  EXPECT_EQ(bench.last.state, ExecutiveState::kStopped);
  EXPECT_FALSE(bench.laser.on());
  EXPECT_EQ(bench.arm.velocity(), JointVector::Zero());
  EXPECT_LT(bench.log.first("laser off"), bench.log.first("stop"));
  EXPECT_LT(bench.log.first("stop"), bench.log.count);
}

TEST(Executive, FaultsWhenTheArmCannotBeRead) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.arm.fail_read = true;
  bench.cycle();
  bench.expect_safe(Fault::kArmRead);
  EXPECT_STREQ(bench.last.error.where, "arm: read joints");
}

TEST(Executive, FaultsWhenTheArmRefusesASetPoint) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.arm.fail_write = true;
  bench.cycle();
  bench.expect_safe(Fault::kArmWrite);
  EXPECT_EQ(bench.last.error.os_errno, 5);
}

TEST(Executive, FaultsWhenTheArmFallsSilent) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.arm.silent = true;
  bench.cycles(49);
  EXPECT_EQ(bench.last.state, ExecutiveState::kRunning);
  bench.log.clear();
  bench.cycles(3);
  bench.expect_safe(Fault::kArmSilent);
}

TEST(Executive, FaultsWhenAJointIsNotWhereItShouldBe) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.arm.stuck = true;
  int cycles = 0;
  while (bench.last.state == ExecutiveState::kRunning && ++cycles < 1000) bench.cycle();
  bench.expect_safe(Fault::kFollowingError);
  ASSERT_TRUE(bench.last.violation);
  EXPECT_EQ(bench.last.violation->joint, kElbow);
  EXPECT_NEAR(cycles * 0.005 * bench.s.sweep.velocity, bench.s.control.following_error_limit, 1.6e-3);
}

TEST(Executive, FaultsWhenTheLaserFails) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.laser.fail_state = true;
  bench.cycle();
  bench.expect_safe(Fault::kLaser);

  ExecutiveBench refused;
  refused.laser.fail = true;
  refused.go();
  for (int i = 0; i < 5000 && refused.last.state != ExecutiveState::kFault; ++i) refused.cycle();
  refused.expect_safe(Fault::kLaser);
}

TEST(Executive, FaultsWhenTheLaserStaysOnLongerThanItsAllowance) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.laser.stuck_on = true;
  bench.sut.set_armed(false);  // the beam is dropped, the plan goes on
  bench.cycles(20);
  EXPECT_EQ(bench.last.state, ExecutiveState::kRunning);
  bench.log.clear();
  bench.cycles(3);
  EXPECT_EQ(bench.last.state, ExecutiveState::kFault);
  EXPECT_EQ(bench.last.fault, Fault::kLaser);
  EXPECT_STREQ(bench.last.error.where, "laser: on though not commanded");
  EXPECT_LT(bench.log.first("laser off"), bench.log.first("stop")) << "the laser goes off first";
  EXPECT_EQ(bench.arm.velocity(), JointVector::Zero());
  bench.laser.stuck_on = false;
  bench.cycles(100);
  bench.expect_safe(Fault::kLaser);
}

TEST(Executive, FaultsWhenTheLaserIsFoundOnBeforeThePlanStarts) {
  ExecutiveBench bench;
  ASSERT_TRUE(BenchRight::light(bench.laser).ok());
  bench.log.clear();
  bench.cycles(30);
  bench.expect_safe(Fault::kLaser);
}

TEST(Executive, FaultsWhenTheLaserStaysDarkBeyondItsWarmUp) {
  ExecutiveBench bench;
  bench.laser.dead = true;
  bench.go();
  for (int i = 0; i < 100000 && !bench.laser.on(); ++i) bench.cycle();
  bench.cycles(50);
  EXPECT_EQ(bench.last.state, ExecutiveState::kRunning);
  bench.log.clear();
  bench.cycles(3);
  bench.expect_safe(Fault::kLaser);
  EXPECT_STREQ(bench.last.error.where, "laser: dark after its warm-up");
}

TEST(Executive, FindsAStuckAndADeadLaserAlsoWhereItSwitchesWithEveryFrame) {
  for (const bool dead : {false, true}) {
    ScanSettings s = settings();
    s.capture.laser_pairs = s.capture.laser_switches_per_frame = true;
    s.capture.laser_warm_up = 0;
    s.sweep.to = 1.6;
    ExecutiveBench bench(s);
    bench.go();
    while (!(bench.laser.on() && bench.plan.segments()[bench.last.segment].phase == Phase::kSweep)) bench.cycle();
    (dead ? bench.laser.dead : bench.laser.stuck_on) = true;
    bench.cycles(130);
    EXPECT_EQ(bench.last.fault, Fault::kLaser) << (dead ? "dead" : "stuck on");
    EXPECT_EQ(bench.plan.segments()[bench.last.segment].phase, Phase::kSweep);
  }
}

TEST(Executive, TriesAgainInEveryCycleWhatFailsToMakeItSafe) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.laser.fail_off = bench.arm.fail_stop = true;
  bench.sut.request_stop();
  bench.cycle();
  EXPECT_FALSE(bench.last.laser_off.ok());
  EXPECT_FALSE(bench.last.arm_stop.ok());
  bench.cycles(10);
  EXPECT_EQ(bench.last.state, ExecutiveState::kFault) << "a laser that refuses to go off is a fault";
  bench.laser.fail_off = bench.arm.fail_stop = false;
  bench.log.clear();
  bench.cycle();
  EXPECT_TRUE(bench.last.laser_off.ok() && bench.last.arm_stop.ok());
  bench.expect_safe(Fault::kLaser);
}

TEST(Executive, StaysDarkUntilItIsToldThatTheInterlockIsClosed) {
  ExecutiveBench bench;
  bench.cycle();
  bench.sut.set_armed(true);
  bench.sut.start(bench.now + 5ms);
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) bench.cycle();
  EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
}

TEST(Executive, DropsBeamAndStopsWhenTheHeartbeatIsLate) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.cycles(49, false);
  EXPECT_TRUE(bench.laser.on());
  bench.log.clear();
  bench.cycles(3, false);
  bench.expect_safe(Fault::kHeartbeat);
}

TEST(Executive, DropsBeamAndStopsWhenTheInterlockOpens) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.sut.set_interlock(false);
  bench.cycle();
  bench.expect_safe(Fault::kInterlock);
}

TEST(Executive, DropsBeamAndStopsWhenTheLasersDeviceReadsAnOpenInterlock) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.laser.loop_closed = true;
  bench.cycle();
  EXPECT_TRUE(bench.laser.on());
  bench.laser.loop_closed = false;
  bench.cycle();
  bench.expect_safe(Fault::kInterlock);
}

TEST(Executive, StaysSafeAfterAFaultEvenIfTheDeviceRecovers) {
  ExecutiveBench bench;
  bench.go_sweeping();
  bench.arm.fail_read = true;
  bench.cycle();
  bench.arm.fail_read = false;
  bench.log.clear();
  bench.cycles(1000);
  bench.expect_safe(Fault::kArmRead);
  EXPECT_EQ(bench.log.first("velocity"), bench.log.count);
  EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
}

TEST(Executive, AllocatesNothingInItsCycle) {
  TANKRIG_SKIP_SANITIZED(testing_support::kNoCounting);
  ExecutiveBench bench;
  bench.go();
  const std::uint64_t before = testing_support::allocations();
  while (bench.last.state != ExecutiveState::kDone && bench.last.cycle < 20000) bench.cycle();
  bench.sut.request_stop();
  bench.arm.fail_read = true;
  bench.cycles(10);
  EXPECT_EQ(testing_support::allocations(), before);
  ::operator delete(::operator new(1));
  EXPECT_EQ(testing_support::allocations(), before + 1) << "the counter does not count";
}

TEST(Executive, DropsAndCountsRecordsThatNobodyReads) {
  ExecutiveBench bench;
  Executive sut(bench.plan, bench.s, bench.arm, bench.laser, 16);
  for (int i = 0; i < 20; ++i) sut.step(Stamp{} + 5ms * i);
  EXPECT_EQ(sut.records_dropped(), 4u);
  CycleRecord record;
  ASSERT_TRUE(sut.try_pop(record));
  EXPECT_EQ(record.cycle, 0u);
}

TEST(CycleGrid, KeepsItsPhaseAndCountsWhatItRanOver) {
  CycleGrid sut({0}, 5ms);
  sut.advance({3'000'000});
  EXPECT_EQ(sut.next(), Stamp{5'000'000});
  sut.advance({10'000'000});
  EXPECT_EQ(sut.next(), Stamp{10'000'000});
  EXPECT_EQ(sut.overruns(), 0u);
  sut.advance({27'000'000});
  EXPECT_EQ(sut.next(), Stamp{30'000'000});
  EXPECT_EQ(sut.overruns(), 1u);
  EXPECT_EQ(sut.missed_cycles(), 3u);
}

}  // namespace
}  // namespace tankrig
