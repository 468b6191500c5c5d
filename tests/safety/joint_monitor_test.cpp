#include "rig/safety/joint_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using Limit = JointViolation::Limit;

JointVector posture() { return (JointVector() << 0, 0.3, 1.3, 0, 0.1).finished(); }

JointVector elbow(double value) {
  JointVector v = JointVector::Zero();
  v[kElbow] = value;
  return v;
}

/// A plan that goes nowhere.
std::array<JointLimit, kJoints> staying(const JointVector& q) {
  std::array<JointLimit, kJoints> reach;
  for (int j = 0; j < kJoints; ++j) reach[static_cast<std::size_t>(j)] = {q[j], q[j]};
  return reach;
}

/// A monitor that sees a state every 10 ms.
struct MonitorBench {
  JointLimits limits;
  JointMonitor sut{limits, 0.05};
  JointState state;

  MonitorBench() {
    state.q = posture();
    sut.set_reach(staying(state.q));
  }
  explicit MonitorBench(const JointLimits& other) : limits(other), sut(other, 0.05) {
    state.q = posture();
    sut.set_reach(staying(state.q));
  }
  JointMonitor::Answer see() {
    state.stamp = state.stamp + 10ms;
    return sut.check_state(state);
  }
  /// Moves the elbow for `length`; the first answer.
  JointMonitor::Answer move(double velocity, Duration length) {
    for (Duration t{}; t < length; t += 10ms) {
      state.q[kElbow] += 0.01 * velocity;
      if (const auto answer = see()) return answer;
    }
    return {};
  }
};

TEST(JointMonitor, HasTheLaboratorysThresholds) {
  const JointLimits sut;
  EXPECT_EQ(sut.angles[kElbow].upper, 2.15294);
  EXPECT_EQ(sut.refusal_margin, 0.05);
  EXPECT_EQ(sut.current.amperes, 2);
  EXPECT_EQ(sut.current.duration, 1500ms);
  EXPECT_EQ(sut.set_point_step, 0.4);
  EXPECT_GT(sut.ticks_per_s, 2000) << "what the driver may ask for";
}

TEST(JointMonitor, SeesAJointBeyondEitherLimitAndSaysWhichAndWhere) {
  for (int j = 0; j < kJoints; ++j) {
    if (j == kJawRotate) continue;
    const auto row = static_cast<std::size_t>(j);
    for (const bool upper : {true, false}) {
      const double limit = upper ? arm5e().limits[row].upper : arm5e().limits[row].lower, side = upper ? 1 : -1;
      MonitorBench inside, outside;
      inside.state.q[j] = limit + side * 0.029;
      EXPECT_FALSE(inside.see()) << "a stop is soft, and there is play";
      outside.state.q[j] = limit + side * 0.031;
      const auto crossed = outside.see();
      ASSERT_TRUE(crossed) << kJointNames[row];
      EXPECT_EQ(crossed->kind, Limit::kAngle);
      EXPECT_EQ(crossed->joint, j);
      EXPECT_EQ(crossed->limit, limit);
    }
  }
  MonitorBench bench;
  bench.state.q[kElbow] = 2.2010;
  EXPECT_EQ(describe(*bench.see()), "elbow at 2.2010 rad, limit 2.1529");
}

TEST(JointMonitor, LetsAJointTurnThatTurnsWithoutEnd) {
  MonitorBench bench;
  bench.state.q[kJawRotate] = 9;
  EXPECT_FALSE(bench.see());
  JointVector turning = JointVector::Zero();
  turning[kJawRotate] = 0.2;
  EXPECT_FALSE(bench.sut.check_set_point(turning, bench.state));
}

TEST(JointMonitor, RefusesASetPointTowardsALimitThatIsNear) {
  MonitorBench bench;
  const double upper = arm5e().limits[kElbow].upper;
  bench.state.q[kElbow] = upper - 0.051;
  EXPECT_FALSE(bench.sut.check_set_point(elbow(0.1), bench.state));
  bench.state.q[kElbow] = upper - 0.049;
  EXPECT_FALSE(bench.sut.check_set_point(elbow(-0.1), bench.state)) << "away from it";
  EXPECT_FALSE(bench.sut.check_set_point(elbow(0), bench.state));
  const auto refused = bench.sut.check_set_point(elbow(0.1), bench.state);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, Limit::kRefusal);
  EXPECT_EQ(refused->joint, kElbow);
  EXPECT_NEAR(refused->limit, upper - 0.05, 1e-12);
  JointVector slew = JointVector::Zero();
  slew[kSlew] = -0.1;
  bench.state.q[kSlew] = arm5e().limits[kSlew].lower + 0.04;
  EXPECT_TRUE(bench.sut.check_set_point(slew, bench.state)) << "lower limits too";
}

TEST(JointMonitor, LetsAPlanGoToTheLimitItselfAndParkThere) {
  MonitorBench bench;
  const double upper = arm5e().limits[kElbow].upper;
  JointVector park = posture();
  park[kElbow] = upper;
  auto reach = staying(posture());
  reach[kElbow].upper = upper;
  bench.sut.set_reach(reach);
  for (const double q : {upper - 0.04, upper, upper + 0.01}) {
    bench.state.q[kElbow] = q;
    EXPECT_FALSE(bench.see()) << q;
    EXPECT_FALSE(bench.sut.check_set_point(elbow(0.06), bench.state)) << q;
  }
  bench.sut.set_reach(staying(posture()));
  bench.state.q[kElbow] = upper;
  EXPECT_FALSE(bench.see()) << "parked at its limit, homed at its stop";
  EXPECT_FALSE(bench.sut.check_set_point(elbow(-0.1), bench.state));
}

TEST(JointMonitor, MeasuresVelocityOverAWindowSoThatATickIsNoSpeed) {
  JointLimits limits;
  limits.velocity = 0.3;
  MonitorBench bench(limits);
  EXPECT_FALSE(bench.move(0.29, 1s));
  EXPECT_FALSE(bench.move(0, 200ms));
  for (int i = 0; i < 100; ++i) {
    bench.state.q[kElbow] += i % 2 == 0 ? 0.0104 : -0.0104;  // 1 rad/s from sample to sample
    EXPECT_FALSE(bench.see());
  }
  const auto crossed = bench.move(-0.6, 1s);
  ASSERT_TRUE(crossed);
  EXPECT_EQ(crossed->kind, Limit::kVelocity);
  EXPECT_EQ(crossed->joint, kElbow);
  EXPECT_GT(crossed->value, 0.3);
}

TEST(JointMonitor, SeesARunawayWithinItsWindow) {
  MonitorBench bench;
  EXPECT_FALSE(bench.move(0.1, 1s));
  const Stamp begin = bench.state.stamp;
  ASSERT_TRUE(bench.move(-2, 1s));
  EXPECT_LE(bench.state.stamp - begin, 70ms);
}

TEST(JointMonitor, SeesAnActuatorFasterThanItIsEverAskedToBe) {
  MonitorBench bench;
  JointMonitor::Answer crossed;
  for (int i = 0; i < 100 && !crossed; ++i) {
    bench.state.ticks[kShoulder] -= 23;
    crossed = bench.see();
  }
  ASSERT_TRUE(crossed);
  EXPECT_EQ(crossed->kind, Limit::kTicks);
  EXPECT_EQ(crossed->joint, kShoulder);
  EXPECT_EQ(describe(*crossed), "shoulder at 2300 ticks/s, limit 2200");
}

TEST(JointMonitor, SeesASetPointThatJumps) {
  MonitorBench bench;
  EXPECT_FALSE(bench.sut.check_set_point(elbow(0.3), bench.state));
  EXPECT_FALSE(bench.sut.check_set_point(elbow(-0.09), bench.state));
  const auto crossed = bench.sut.check_set_point(elbow(0.4), bench.state);
  ASSERT_TRUE(crossed);
  EXPECT_EQ(crossed->kind, Limit::kSetPointStep);
  JointLimits any;
  any.set_point_step = 0;
  MonitorBench off(any);
  EXPECT_FALSE(off.sut.check_set_point(elbow(0.3), off.state));
  EXPECT_FALSE(off.sut.check_set_point(elbow(-0.3), off.state));
}

TEST(JointMonitor, SeesACurrentThatIsTooHighForTooLong) {
  MonitorBench bench;
  bench.state.current_a = 2.01;
  JointMonitor::Answer crossed;
  const Stamp begin = bench.state.stamp + 10ms;
  for (int i = 0; i < 1000 && !crossed; ++i) crossed = bench.see();
  ASSERT_TRUE(crossed);
  EXPECT_EQ(crossed->kind, Limit::kCurrent);
  EXPECT_EQ(bench.state.stamp - begin, 1500ms);
}

TEST(JointMonitor, DoesNotMindAShortPeakOfTheCurrent) {
  MonitorBench bench;
  for (int i = 0; i < 1000; ++i) {
    bench.state.current_a = i % 150 == 0 ? 2.0 : 5;
    EXPECT_FALSE(bench.see());
  }
}

TEST(JointMonitor, SeesAJointFarFromItsPlan) {
  const MonitorBench bench;
  EXPECT_FALSE(bench.sut.check_following(posture() + elbow(0.0499), posture()));
  const auto crossed = bench.sut.check_following(posture() + elbow(-0.051), posture());
  ASSERT_TRUE(crossed);
  EXPECT_EQ(crossed->kind, Limit::kFollowingError);
  EXPECT_EQ(describe(*crossed), "joint elbow of 0.0510 rad, limit 0.0500");
}

TEST(JointMonitor, LeavesAnArmAloneThatDoesNotKnowItsAngles) {
  MonitorBench bench;
  bench.state.q.setConstant(std::numeric_limits<double>::quiet_NaN());
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(bench.see());
  EXPECT_FALSE(bench.sut.check_following(posture(), bench.state.q));
}

}  // namespace
}  // namespace tankrig
