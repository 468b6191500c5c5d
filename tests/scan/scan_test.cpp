#include "rig/scan/scan.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/input_error.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using sim::MockArm;
using sim::MockLaser;
using testing_support::RecordingSink;
using Bench = testing_support::MockRig;

TEST(Scan, RecordsDarkBlocksAndSweepInOrderWithNothingLost) {
  Bench bench;
  const ScanResult result = bench.run();
  EXPECT_EQ(result.status, "complete");
  EXPECT_EQ(bench.sink.of("mono", Phase::kDarkBefore).size(), 5u);
  EXPECT_EQ(bench.sink.of("mono", Phase::kDarkAfter).size(), 5u);
  EXPECT_EQ(bench.sink.of("left", Phase::kDarkBefore).size(), 5u);
  EXPECT_EQ(bench.sink.of("left", Phase::kSweep).size(), 0u);
  EXPECT_NEAR(static_cast<double>(bench.sink.of("mono", Phase::kSweep).size()), 125, 1);
  EXPECT_NEAR(result.simulated_s, bench.plan->duration(), 0.3);
  for (const auto& [reason, count] : result.counts) {
    EXPECT_TRUE(count == 0 || reason.find("recorded") != std::string::npos) << reason;
  }
  int mono = 0;
  for (const FrameRecord& f : bench.sink.frames)
    if (f.camera == "mono") {
      EXPECT_EQ(f.index, mono++);
    }
}

TEST(Scan, AccountsForEveryFrameThatWasTaken) {
  Bench bench;
  const ScanResult result = bench.run();
  for (const char* camera : {"mono", "left"}) {
    std::uint64_t accounted = 0;
    for (const auto& [reason, count] : result.counts)
      if (reason.rfind(std::string(camera) + ".", 0) == 0) accounted += count;
    EXPECT_EQ(accounted, static_cast<std::uint64_t>(bench.rendered[camera])) << camera;
  }
}

TEST(Scan, RendersNextToNothingWhileNobodyRecords) {
  Bench bench;
  bench.run();
  EXPECT_LE(bench.rendered["mono"], 125 + 10 + 30);
  EXPECT_LE(bench.rendered["left"], 10 + 20);
}

TEST(Scan, LightsTheLaserInSweepFramesOnlyAndTagsThemTruly) {
  Bench bench;
  bench.run();
  for (std::size_t i = 0; i < bench.sink.frames.size(); ++i) {
    const FrameRecord& f = bench.sink.frames[i];
    EXPECT_EQ(f.laser_on, f.phase == Phase::kSweep);
    EXPECT_EQ(bench.sink.pixels[i], f.laser_on ? 3 : 0) << to_string(f.phase) << " " << f.index;
  }
}

TEST(Scan, MovesTheElbowWithinOnePercentOfItsVelocityOverAnySecondOfTheSweep) {
  for (const double velocity : {0.1, 0.08, 0.065}) {
    Bench bench;
    bench.s.sweep.velocity = velocity;
    bench.run();
    const auto frames = bench.sink.of("mono", Phase::kSweep);
    ASSERT_GT(frames.size(), 100u);
    double worst = 0;
    for (Stamp t = frames.front().stamp; t + 1s <= frames.back().stamp; t = t + 10ms)
      worst =
          std::max(worst, std::abs(bench.arm->truth_at(t + 1s)[kElbow] - bench.arm->truth_at(t)[kElbow] - velocity));
    EXPECT_LT(worst, 0.01 * velocity);
    RecordProperty("worst_relative_velocity_error", std::to_string(worst / velocity));
  }
}

TEST(Scan, JoinsEveryFrameToTheJointsItWasExposedAt) {
  Bench bench;
  const ScanResult result = bench.run();
  const double tick = bench.model.actuators[kElbow].resolution(1.55);
  double worst = 0;
  for (const FrameRecord& f : bench.sink.frames) {
    ASSERT_TRUE(f.q);
    worst = std::max(worst, std::abs((*f.q)[kElbow] - bench.arm->truth_at(f.stamp)[kElbow]));
    EXPECT_LE(f.sync_residual, 5ms);
  }
  EXPECT_LE(worst, 0.75 * bench.model.actuators[kElbow].resolution(1.8) + 0.2 * tick);
  EXPECT_LE(result.worst_residual, 5ms);
}

TEST(Scan, IsWrongByVelocityTimesLatencyWhereTheLatencyIsNotKnown) {
  Bench bench;
  bench.mock.arm.latency_known = false;
  bench.mock.arm.feedback_latency = 30ms;
  bench.run();
  double sum = 0;
  const auto frames = bench.sink.of("mono", Phase::kSweep);
  for (const FrameRecord& f : frames) sum += bench.arm->truth_at(f.stamp)[kElbow] - (*f.q)[kElbow];
  EXPECT_NEAR(sum / static_cast<double>(frames.size()), 0.1 * 0.030, 5e-5);
}

TEST(Scan, InterleavesThePassesOnTheCamerasOwnGrid) {
  for (const bool there_and_back : {true, false}) {
    Bench bench;
    bench.s.sweep.passes = 2;
    bench.s.sweep.there_and_back = there_and_back;
    bench.run();
    const double step = bench.s.sweep.velocity * bench.s.capture.frame_period;
    double sum[2] = {0, 0};
    int count[2] = {0, 0};
    for (const FrameRecord& f : bench.sink.of("mono", Phase::kSweep)) {
      const double lines = ((*f.q)[kElbow] - bench.s.sweep.from) / step - 0.5 * f.pass;
      sum[f.pass] += lines - std::round(lines);
      EXPECT_LT(std::abs(lines - std::round(lines)), 0.25) << "pass " << f.pass << " elbow " << (*f.q)[kElbow];
      ++count[f.pass];
    }
    EXPECT_NEAR(count[0], 125, 1);
    EXPECT_NEAR(count[1], 125, 1);
    EXPECT_NEAR(sum[1] / count[1], sum[0] / count[0], 0.1) << "the second pass is not midway between the first's lines";
  }
}

TEST(Scan, GivesTheSameRecordsTwice) {
  Bench a, b;
  const ScanResult first = a.run(), second = b.run();
  EXPECT_EQ(first.counts, second.counts);
  ASSERT_EQ(a.sink.states.size(), b.sink.states.size());
  for (std::size_t i = 0; i < a.sink.states.size(); ++i) {
    EXPECT_EQ(a.sink.states[i].stamp, b.sink.states[i].stamp);
    EXPECT_EQ(a.sink.states[i].q, b.sink.states[i].q);
  }
  ASSERT_EQ(a.sink.frames.size(), b.sink.frames.size());
  for (std::size_t i = 0; i < a.sink.frames.size(); ++i) {
    EXPECT_EQ(a.sink.frames[i].stamp, b.sink.frames[i].stamp);
    EXPECT_EQ(*a.sink.frames[i].q, *b.sink.frames[i].q);
  }
  ASSERT_EQ(a.sink.events.size(), b.sink.events.size());
}

TEST(Scan, CountsFramesTheWireLost) {
  Bench bench;
  bench.mock.camera.drop_every = 10;
  const ScanResult result = bench.run();
  EXPECT_TRUE(result.complete());
  const auto frames = bench.sink.of("mono", Phase::kSweep);
  EXPECT_NEAR(static_cast<double>(frames.size()), 125 * 0.9, 2);
  EXPECT_NEAR(static_cast<double>(result.counts.at("mono.lost")), 14, 3);
}

TEST(Scan, EndsParkedWithEverythingOff) {
  Bench bench;
  bench.run();
  bench.clock.sleep_until(bench.clock.now() + 1s);
  const JointVector end = bench.arm->truth_at(bench.clock.now());
  EXPECT_LT((end - bench.s.park).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_EQ(bench.arm->true_velocity_at(bench.clock.now()), JointVector::Zero());
  EXPECT_FALSE(bench.laser->state().value().powered);
}

TEST(Scan, StopsSafelyWhenAskedToAndSaysSo) {
  Bench bench;
  bench.progress = [&](const ScanProgress& p) {
    if (p.phase == Phase::kSweep && p.fraction > 0.5) bench.stop = true;
  };
  const ScanResult result = bench.run();
  EXPECT_EQ(result.status, "stopped: asked for");
  EXPECT_FALSE(bench.laser->state().value().powered);
  EXPECT_LT(bench.arm->true_velocity_at(bench.clock.now()).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_GT(bench.sink.of("mono", Phase::kSweep).size(), 10u);
  EXPECT_EQ(bench.sink.of("mono", Phase::kDarkAfter).size(), 0u);
  EXPECT_TRUE(result.left.safe());
}

TEST(Scan, LeavesTheRigSafeWhenTheSinkThrows) {
  Bench bench;
  bench.sink.throw_at = 50;
  EXPECT_THROW(bench.run(), std::runtime_error);
  EXPECT_FALSE(bench.laser->state().value().powered);
  EXPECT_LT(bench.arm->true_velocity_at(bench.clock.now()).cwiseAbs().maxCoeff(), 1e-2);
  EXPECT_TRUE(bench.left.safe());
  EXPECT_TRUE(bench.sink.told("stop", "disk full; laser off, arm at rest"));
}

TEST(Scan, StopsWithTheJointNamedWhenTheArmCannotFollow) {
  Bench bench;
  bench.mock.arm.max_ticks_per_s = 200;
  const ScanResult result = bench.run();
  EXPECT_NE(result.status.find("stopped: following error: joint"), std::string::npos) << result.status;
  EXPECT_NE(result.status.find("move to the sweep's start"), std::string::npos) << result.status;
}

TEST(Scan, RefusesALaserThatWarmsUpLongerThanThePlanWaits) {
  Bench bench;
  bench.mock.laser_warm_up = 3s;
  EXPECT_THROW(bench.run(), InputError);
  EXPECT_TRUE(bench.sink.states.empty());
}

TEST(Scan, PairsLitAndDarkFramesWithALaserThatSwitchesPerFrame) {
  Bench bench;
  bench.s.capture.laser_pairs = bench.s.capture.laser_switches_per_frame = true;
  bench.s.capture.laser_warm_up = 0;
  bench.mock.laser_warm_up = 0s;
  const ScanResult result = bench.run();
  EXPECT_EQ(result.counts.count("mono.laser_switching"), 0u);
  int lit = 0;
  for (std::size_t i = 0; i < bench.sink.frames.size(); ++i) {
    EXPECT_EQ(bench.sink.pixels[i], bench.sink.frames[i].laser_on ? 3 : 0);
    lit += bench.sink.frames[i].laser_on;
  }
  EXPECT_NEAR(lit, 125 / 2.0, 1);
}

TEST(Scan, UsesNoFrameInWhichTheLaserSwitched) {
  Bench bench;
  bench.s.capture.laser_pairs = bench.s.capture.laser_switches_per_frame = true;
  bench.s.capture.laser_warm_up = 0;
  bench.mock.laser_warm_up = 0s;
  bench.mock.camera.exposure = 38ms;
  const ScanResult result = bench.run();
  EXPECT_GT(result.counts.at("mono.laser_switching"), 50u);
  for (std::size_t i = 0; i < bench.sink.frames.size(); ++i)
    EXPECT_TRUE(bench.sink.pixels[i] == 0 || bench.sink.pixels[i] == 3);
}

TEST(Scan, TellsItsProgressFromZeroToOne) {
  Bench bench;
  double last = -1;
  bench.progress = [&](const ScanProgress& p) {
    EXPECT_GE(p.fraction, last);
    last = p.fraction;
  };
  bench.run();
  EXPECT_GT(last, 0.99);
}

TEST(Scan, NeedsNoCameraToSweep) {
  Bench bench;
  bench.power_on();
  const ScanPlan plan = make_scan_plan(bench.s, bench.s.park);
  ScanJob job{plan, bench.s, bench.clock, *bench.arm, *bench.laser, {}, bench.sink, bench.stop, bench.interlock_closed,
              {}};
  EXPECT_TRUE(run_scan(job).complete());
  EXPECT_GT(bench.sink.states.size(), 1000u);
}

TEST(Scan, WorksUnderTheRealClockToo) {
  MonotonicClock clock;
  ScanSettings s;
  s.park << 0, 0.12, 1.0, 0, 0.1;
  s.posture = s.park;
  s.sweep.from = 1.045;
  s.sweep.to = 1.065;
  s.capture.dark_frames = 1;
  s.move.settle = s.capture.laser_warm_up = 0.05;
  s.control.heartbeat_timeout = s.control.feedback_timeout = 5;  // the machine may be busy
  s.control.following_error_limit = 1;
  s.real_time.overruns = 0;
  MockArm arm(arm5e(), {}, s.park, clock);
  MockLaser laser(50ms, clock);
  RecordingSink sink;
  const std::atomic<bool> stop{false};
  const ScanPlan plan = make_scan_plan(s, s.park);
  ScanJob job{plan, s, clock, arm, laser, {}, sink, stop, [] { return true; }, {}};
  testing_support::MachineWitness witness;
  const ScanResult result = run_scan(job);
  EXPECT_TRUE(result.complete()) << result.status;
  EXPECT_GE(result.simulated_s, plan.duration());
  TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  EXPECT_LE(result.simulated_s, plan.duration() + 1.0 + s.safety.indicator_delay);
}

}  // namespace
}  // namespace tankrig
