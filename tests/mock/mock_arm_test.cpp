#include "sim_backends/mock/mock_arm.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "tests/support/bench_right.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

struct ArmBench {
  VirtualClock clock;
  MockArmParameters parameters;
  JointVector start = (JointVector() << 0, 0.12, 1.0, 0, 0.1).finished();
  ArmModel model = arm5e();

  MockArm make() { return MockArm(model, parameters, start, clock); }
};

JointVector elbow(double velocity) {
  JointVector v = JointVector::Zero();
  v[kElbow] = velocity;
  return v;
}

/// Commands `velocity` every 5 ms for `length`.
void drive(ArmBench& bench, MockArm& arm, const JointVector& velocity, Duration length) {
  const Stamp end = bench.clock.now() + length;
  while (bench.clock.now() < end) {
    ASSERT_TRUE(drive(arm, velocity).ok());
    bench.clock.sleep_until(bench.clock.now() + 5ms);
  }
}

TEST(MockArm, RestsInItsPostureAtPowerOn) {
  ArmBench bench;
  MockArm sut = bench.make();
  bench.clock.sleep_until({1'000'000'000});
  EXPECT_TRUE(sut.truth_at(bench.clock.now()).isApprox(bench.start, 1e-12));
  const auto state = sut.try_read();
  ASSERT_TRUE(state.ok() && state.value());
  for (int j = 0; j < kJoints; ++j)
    EXPECT_NEAR(state.value()->q[j], bench.start[j], 0.51 * bench.model.actuators[j].resolution(bench.start[j]));
}

TEST(MockArm, FollowsASetPointWithFirstOrderLagExactly) {
  ArmBench bench;
  bench.parameters.time_constant = 0.05;
  MockArm sut = bench.make();
  const double slope = bench.model.actuators[kElbow].resolution(1.0);
  ASSERT_TRUE(drive(sut, elbow(0.1)).ok());
  const double demand = -std::round(0.1 / slope);  // the elbow's actuator shortens as its angle grows
  bench.clock.sleep_until({400'000'000});
  for (double t : {0.003, 0.05, 0.123456, 0.35}) {
    const double ticks = bench.model.actuators[kElbow].ticks(1.0) + demand * (t - 0.05 * (1 - std::exp(-t / 0.05)));
    const Stamp when = Stamp{10'000'000} + from_seconds(t);
    EXPECT_NEAR(sut.truth_at(when)[kElbow], bench.model.actuators[kElbow].angle(ticks), 1e-9) << t;
  }
}

TEST(MockArm, TellsTruthTheSameHoweverOftenItIsAsked) {
  ArmBench a, b;
  MockArm coarse = a.make(), fine = b.make();
  drive(a, coarse, elbow(0.1), 300ms);
  for (int i = 0; i < 60; ++i) {
    ASSERT_TRUE(drive(fine, elbow(0.1)).ok());
    for (int k = 0; k < 5; ++k) {
      b.clock.sleep_until(b.clock.now() + 1ms);
      (void)fine.truth_at(b.clock.now());
    }
  }
  for (int ms = 0; ms < 300; ms += 7)
    EXPECT_EQ(coarse.truth_at({ms * 1'000'000}), fine.truth_at({ms * 1'000'000})) << ms;
}

TEST(MockArm, RaisesSlowCommandsToItsDeadZoneAndIgnoresCreep) {
  ArmBench bench;
  MockArm sut = bench.make();
  EXPECT_EQ(drive(sut, elbow(0.009)).value()[kElbow], 0);
  EXPECT_NEAR(drive(sut, elbow(0.02)).value()[kElbow], 0.06, 2e-4);
  EXPECT_NEAR(drive(sut, elbow(-0.02)).value()[kElbow], -0.06, 2e-4);
  EXPECT_NEAR(drive(sut, elbow(0.1)).value()[kElbow], 0.1, 2e-4);
}

TEST(MockArm, SlowsAllAxesTogetherAtItsSpeedLimit) {
  ArmBench bench;
  MockArm sut = bench.make();
  JointVector v = JointVector::Zero();
  v[kShoulder] = 0.4;
  v[kElbow] = 0.2;
  const JointVector applied = drive(sut, v).value();
  EXPECT_NEAR(applied[kShoulder] / bench.model.actuators[kShoulder].resolution(0.12), 2000, 1);
  EXPECT_NEAR(applied[kElbow] / applied[kShoulder], 0.5, 2e-3);
}

TEST(MockArm, StampsTheTrueSamplingTimeWhenItsLatencyIsKnown) {
  for (const bool known : {true, false}) {
    ArmBench bench;
    bench.parameters.latency_known = known;
    bench.parameters.feedback_latency = 23ms;
    MockArm sut = bench.make();
    const double omega = 0.1;
    double worst = 0, sum = 0;
    int samples = 0;
    for (int i = 0; i < 400; ++i) {
      ASSERT_TRUE(drive(sut, elbow(omega)).ok());
      bench.clock.sleep_until(bench.clock.now() + 5ms);
      const auto state = sut.try_read();
      if (!state.value() || i < 100) continue;
      const double error = sut.truth_at(state.value()->stamp)[kElbow] - state.value()->q[kElbow];
      worst = std::max(worst, std::abs(error));
      sum += error;
      ++samples;
    }
    ASSERT_GT(samples, 100);
    const double tick = bench.model.actuators[kElbow].resolution(1.1);
    if (known)
      EXPECT_LE(worst, 0.52 * tick);
    else
      EXPECT_NEAR(sum / samples, omega * 0.023, 0.1 * tick);
  }
}

TEST(MockArm, DeliversAStateOnceAndOnlyAfterItsLatency) {
  ArmBench bench;
  MockArm sut = bench.make();
  bench.clock.sleep_until({14'999'999});
  EXPECT_FALSE(sut.try_read().value());
  bench.clock.sleep_until({15'000'000});
  const auto state = sut.try_read().value();
  ASSERT_TRUE(state);
  EXPECT_EQ(state->stamp, Stamp{10'000'000});
  EXPECT_FALSE(sut.try_read().value());
}

TEST(MockArm, StopsByItselfWhenSetPointsStay) {
  ArmBench bench;
  MockArm sut = bench.make();
  drive(bench, sut, elbow(0.1), 300ms);
  bench.clock.sleep_until(bench.clock.now() + 400ms);
  EXPECT_GT(sut.true_velocity_at(bench.clock.now())[kElbow], 0.09);
  bench.clock.sleep_until(bench.clock.now() + 1s);
  EXPECT_EQ(sut.true_velocity_at(bench.clock.now())[kElbow], 0);
}

TEST(MockArm, StopsWhenTold) {
  ArmBench bench;
  MockArm sut = bench.make();
  drive(bench, sut, elbow(0.1), 300ms);
  ASSERT_TRUE(sut.stop().ok());
  bench.clock.sleep_until(bench.clock.now() + 500ms);
  EXPECT_EQ(sut.true_velocity_at(bench.clock.now())[kElbow], 0);
}

TEST(MockArm, FailsInTheWaysATestAsksFor) {
  ArmBench bench;
  MockArm sut = bench.make();
  drive(bench, sut, elbow(0.1), 300ms);
  sut.faults.stop_fails = true;
  EXPECT_EQ(sut.stop().error().code, ErrorCode::kIo);
  bench.clock.sleep_until(bench.clock.now() + 300ms);
  EXPECT_GT(sut.true_velocity_at(bench.clock.now())[kElbow], 0.09);
  sut.faults.stop_fails = false;
  sut.faults.runs_away = true;
  ASSERT_TRUE(sut.stop().ok());
  drive(bench, sut, JointVector::Zero(), 1s);
  EXPECT_GT(sut.true_velocity_at(bench.clock.now())[kElbow], 0.09);
  sut.faults.runs_away = false;
  ASSERT_TRUE(sut.stop().ok());
  bench.clock.sleep_until(bench.clock.now() + 500ms);
  EXPECT_EQ(sut.true_velocity_at(bench.clock.now())[kElbow], 0);
}

TEST(MockArm, MayBeStoppedFromAnyThread) {
  MonotonicClock clock;
  MockArmParameters parameters;
  parameters.exchange_period = 2us * testing_support::kSlowness;
  parameters.feedback_latency = 0s;
  MockArm sut(arm5e(), parameters, (JointVector() << 0, 0.12, 1.0, 0, 0.1).finished(), clock);
  ASSERT_TRUE(drive(sut, elbow(0.1)).ok());
  sut.faults.runs_away = true;  // it keeps moving, so that an exchange made twice or left out is seen
  std::atomic<bool> done{false};
  std::thread other([&] {
    while (!done) (void)sut.stop();
  });
  JointState last;
  int backwards = 0;
  const auto gone_far = [&] { return last.q[kElbow] > 1.002; };
  for (const Stamp end = clock.now() + 400ms; clock.now() < end || (!gone_far() && clock.now() < end + 20s);) {
    const auto state = sut.try_read().value();
    if (!state) continue;
    backwards += state->stamp <= last.stamp || state->q[kElbow] < last.q[kElbow];
    last = *state;
  }
  done = true;
  other.join();
  EXPECT_EQ(backwards, 0);
  EXPECT_TRUE(gone_far());
  sut.faults.runs_away = false;
  std::thread([&] { EXPECT_TRUE(sut.stop().ok()); }).join();
  const Stamp stopped = clock.now();
  for (const Stamp end = stopped + 100ms; clock.now() < end;) (void)sut.try_read();
  EXPECT_LT(sut.true_velocity_at(clock.now())[kElbow], 0.02);
}

TEST(MockArm, StopsAtItsJointLimits) {
  ArmBench bench;
  bench.start[kElbow] = 2.14;
  MockArm sut = bench.make();
  drive(bench, sut, elbow(0.1), 1s);
  EXPECT_NEAR(sut.truth_at(bench.clock.now())[kElbow], bench.model.limits[kElbow].upper, 1e-9);
  drive(bench, sut, elbow(-0.1), 500ms);
  EXPECT_LT(sut.truth_at(bench.clock.now())[kElbow], bench.model.limits[kElbow].upper - 0.03);
}

TEST(MockArm, LosesItsBacklashWhenItTurnsAround) {
  ArmBench bench;
  bench.parameters.backlash_ticks[kElbow] = 20;
  MockArm sut = bench.make();
  const double tick = bench.model.actuators[kElbow].resolution(1.0);
  const auto lag = [&] {
    bench.clock.sleep_until(bench.clock.now() + 100ms);
    const auto state = sut.try_read().value();
    return state->q[kElbow] - sut.truth_at(state->stamp)[kElbow];
  };
  drive(bench, sut, elbow(0.1), 500ms);
  EXPECT_NEAR(lag(), 10 * tick, 1.5 * tick);
  drive(bench, sut, elbow(-0.1), 500ms);
  EXPECT_NEAR(lag(), -10 * tick, 1.5 * tick);
}

TEST(MockArm, IsAsMuchSlowerThanAskedAsItsGainSays) {
  ArmBench bench;
  bench.parameters.speed_gain[kElbow] = 0.9;
  MockArm sut = bench.make();
  drive(bench, sut, elbow(0.1), 500ms);
  EXPECT_NEAR(sut.true_velocity_at(bench.clock.now())[kElbow], 0.09, 3e-4);
}

TEST(MockArm, SticksBelowItsStiction) {
  ArmBench bench;
  bench.parameters.stiction_ticks_per_s[kElbow] = 1500;  // 0.16 rad/s here
  MockArm sut = bench.make();
  drive(bench, sut, elbow(0.1), 500ms);
  EXPECT_EQ(sut.true_velocity_at(bench.clock.now())[kElbow], 0);
  drive(bench, sut, elbow(0.18), 500ms);
  EXPECT_GT(sut.true_velocity_at(bench.clock.now())[kElbow], 0.17);
}

TEST(MockArm, CannotBeAskedForADemandWhoseLowByteIs0A) {
  ArmBench bench;
  MockArm sut = bench.make();
  const double slope = bench.model.actuators[kElbow].resolution(1.0);
  for (const int high : {3, 4}) {
    const double asked = high * 256 + 0x0A;
    EXPECT_NEAR(drive(sut, elbow(asked * slope)).value()[kElbow], (asked + 1) * slope, 1e-9);
    EXPECT_NEAR(drive(sut, elbow((asked + 2) * slope)).value()[kElbow], (asked + 2) * slope, 1e-9);
  }
}

TEST(MockArm, TellsTheCurrentOfItsWholeArmMostOfAllAtAStop) {
  ArmBench bench;
  bench.start[kElbow] = 2.14;
  MockArm sut = bench.make();
  drive(bench, sut, JointVector::Zero(), 100ms);
  EXPECT_LT(sut.try_read().value()->current_a, 0.3);
  drive(bench, sut, elbow(0.1), 1s);
  EXPECT_GT(sut.try_read().value()->current_a, 1.0) << "the laboratory's threshold of a stop";
}

}  // namespace
}  // namespace tankrig::sim
