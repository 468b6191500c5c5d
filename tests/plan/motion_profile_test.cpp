#include "rig/plan/motion_profile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tankrig {
namespace {

/// Speeds, accelerations, jerks and ways over several decades: every shape a profile can have is among them.
class RandomProfiles {
 public:
  ProfileLimits limits() { return {decades(-2, 0.5), decades(-1, 1), decades(-0.5, 2)}; }
  double distance() { return decades(-5, 0.5); }

 private:
  double decades(double from, double to) { return std::pow(10, std::uniform_real_distribution(from, to)(random_)); }
  std::mt19937 random_{kSeed};

 public:
  static constexpr unsigned kSeed = 3;
};

TEST(SCurveProfile, ReachesItsDistanceInTheAnalyticTime) {
  const SCurveProfile sut(0.8, {0.1, 0.5, 5});
  EXPECT_DOUBLE_EQ(sut.ramp().duration(), 0.1 / 0.5 + 0.5 / 5);
  EXPECT_DOUBLE_EQ(sut.ramp().distance(), 0.5 * 0.1 * 0.3);
  EXPECT_DOUBLE_EQ(sut.duration(), 0.8 / 0.1 + 0.3);
  EXPECT_NEAR(sut.at(sut.duration() / 2).position, 0.4, 1e-15);
  EXPECT_EQ(sut.at(sut.duration() / 2).velocity, 0.1);
  EXPECT_EQ(sut.at(0.15).acceleration, 0.5);
  EXPECT_EQ(sut.at(0.05).jerk, 5);
  EXPECT_EQ(sut.at(0.25).jerk, -5);
}

TEST(SCurveProfile, RampsWithoutConstantAccelerationWhereTheLimitIsNotReached) {
  const SCurveProfile sut(0.8, {0.1, 1.0, 5});
  const double half = std::sqrt(0.1 / 5);
  EXPECT_DOUBLE_EQ(sut.ramp().duration(), 2 * half);
  EXPECT_NEAR(sut.at(half).acceleration, 5 * half, 1e-12);
  EXPECT_LT(sut.at(half).acceleration, 1.0);
}

TEST(SCurveProfile, IsSlowerWhereTheWayIsTooShortToCruise) {
  const double a = 0.5, j = 5, distance = 0.02;
  const SCurveProfile sut(distance, {1.0, a, j});
  const double peak = sut.ramp().velocity();
  EXPECT_LT(peak, 1.0);
  EXPECT_NEAR(peak * (peak / a + a / j), distance, 1e-15);
  EXPECT_NEAR(sut.at(sut.duration() / 2).velocity, peak, 1e-12);
}

TEST(SCurveProfile, IsFourStretchesOfJerkWhereTheWayIsShorterStill) {
  const double j = 5, distance = 1e-4;
  const SCurveProfile sut(distance, {1.0, 0.5, j});
  const double quarter = std::cbrt(distance / (2 * j));
  EXPECT_NEAR(sut.duration(), 4 * quarter, 1e-12);
  EXPECT_NEAR(sut.at(quarter).acceleration, j * quarter, 1e-9);
  EXPECT_LT(sut.at(quarter).acceleration, 0.5);
  EXPECT_NEAR(sut.at(2 * quarter).position, distance / 2, 1e-12);
}

TEST(SCurveProfile, RestsOutsideItsTimeAndEndsExactly) {
  SCOPED_TRACE("seed " + std::to_string(RandomProfiles::kSeed));
  RandomProfiles random;
  for (int trial = 0; trial < 300; ++trial) {
    const double distance = random.distance();
    const SCurveProfile sut(distance, random.limits());
    for (double t : {-1.0, 0.0, sut.duration(), sut.duration() + 1e-9, 1e6}) {
      const ProfilePoint p = sut.at(t);
      EXPECT_EQ(p.position, t <= 0 ? 0 : distance);
      EXPECT_EQ(p.velocity, 0);
      EXPECT_EQ(p.acceleration, 0);
      EXPECT_EQ(p.jerk, 0);
    }
  }
  EXPECT_EQ(SCurveProfile(0, {0.1, 0.5, 5}).duration(), 0);
  EXPECT_EQ(SCurveProfile(0, {0.1, 0.5, 5}).at(1).position, 0);
}

TEST(SCurveProfile, KeepsItsBoundsAndItsDerivativesAreThoseOfItsPosition) {
  SCOPED_TRACE("seed " + std::to_string(RandomProfiles::kSeed));
  RandomProfiles random;
  int cruising = 0, slower = 0, gentler = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const ProfileLimits limits = random.limits();
    const double distance = random.distance();
    const SCurveProfile sut(distance, limits);
    const double h = 1e-4 * sut.ramp().duration();
    double fastest = 0, hardest = 0;
    for (int i = 1; i < 200; ++i) {
      const double t = sut.duration() * i / 200;
      const ProfilePoint before = sut.at(t - h), p = sut.at(t), after = sut.at(t + h);
      EXPECT_GE(p.velocity, 0);
      EXPECT_LE(p.velocity, limits.velocity * (1 + 1e-12));
      EXPECT_LE(std::abs(p.acceleration), limits.acceleration * (1 + 1e-9));
      EXPECT_LE(std::abs(p.jerk), limits.jerk);
      EXPECT_GE(p.position, before.position);
      EXPECT_NEAR((after.position - before.position) / (2 * h), p.velocity, limits.jerk * h * h + 1e-9 * distance / h);
      EXPECT_NEAR((after.velocity - before.velocity) / (2 * h), p.acceleration, limits.jerk * h + 1e-9);
      EXPECT_LE(std::abs(after.acceleration - before.acceleration), 2 * h * limits.jerk * (1 + 1e-6) + 1e-12)
          << "a jump of the acceleration at " << t;
      fastest = std::max(fastest, p.velocity);
      hardest = std::max(hardest, p.acceleration);
    }
    EXPECT_NEAR(sut.at(0.5 * sut.duration()).position, 0.5 * distance, 1e-9 * distance);
    if (fastest > 0.999 * limits.velocity)
      ++cruising;
    else if (hardest > 0.98 * limits.acceleration)
      ++slower;
    else
      ++gentler;
  }
  EXPECT_GT(cruising, 50);
  EXPECT_GT(slower, 50);
  EXPECT_GT(gentler, 50);
}

TEST(SCurveProfile, IsContinuousWhereItsShapesMeet) {
  const double v = 0.1, a = 0.5, j = 5;
  const double cruises = v * (v / a + a / j), accelerates = 2 * a * a * a / (j * j);
  for (const double edge : {cruises, accelerates}) {
    const SCurveProfile below(edge * (1 - 1e-9), {v, a, j}), above(edge * (1 + 1e-9), {v, a, j});
    EXPECT_NEAR(below.duration(), above.duration(), 1e-7) << edge;
    for (int i = 0; i <= 100; ++i) {
      const double t = above.duration() * i / 100;
      EXPECT_NEAR(below.at(t).position, above.at(t).position, 1e-9);
      EXPECT_NEAR(below.at(t).velocity, above.at(t).velocity, 1e-7);
    }
  }
}

TEST(JointMove, IsAStraightLineInJointSpaceThatStartsAndStopsTogether) {
  JointVector from, to;
  from << 0, 0.1, 0.2, 0.3, 0.4;
  to << -0.5, 0.9, 0.2, 0.1, 0.4;
  const JointMove sut(from, to, {0.1, 0.5, 5});
  EXPECT_DOUBLE_EQ(sut.duration(), 0.8 / 0.1 + 0.3);
  EXPECT_TRUE(sut.at(0).q.isApprox(from));
  EXPECT_TRUE(sut.at(sut.duration()).q.isApprox(to));
  for (double t = 0; t < sut.duration(); t += 0.1) {
    const MotionPoint p = sut.at(t);
    EXPECT_NEAR((p.q - from).dot(to - from), (p.q - from).norm() * (to - from).norm(), 1e-12);
    EXPECT_LE(p.velocity.cwiseAbs().maxCoeff(), 0.1 + 1e-12);
    EXPECT_LE(p.acceleration.cwiseAbs().maxCoeff(), 0.5 + 1e-12);
  }
}

TEST(JointMove, OfNoDistanceTakesNoTime) {
  const JointMove sut(JointVector::Ones(), JointVector::Ones(), {0.1, 0.5, 5});
  EXPECT_EQ(sut.duration(), 0);
  EXPECT_EQ(sut.at(1).q, JointVector::Ones());
}

}  // namespace
}  // namespace tankrig
