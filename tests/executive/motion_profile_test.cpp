#include "rig/executive/motion_profile.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tankrig {
namespace {

TEST(TrapezoidProfile, ReachesItsDistanceInTheAnalyticTime) {
  const TrapezoidProfile sut(0.8, 0.1, 0.5);
  EXPECT_DOUBLE_EQ(sut.duration(), 0.8 / 0.1 + 0.1 / 0.5);
  EXPECT_DOUBLE_EQ(sut.ramp_distance(), 0.1 * 0.1 / (2 * 0.5));
  EXPECT_DOUBLE_EQ(sut.at(sut.duration()).position, 0.8);
  EXPECT_DOUBLE_EQ(sut.at(4.1).position, 0.4);
  EXPECT_DOUBLE_EQ(sut.at(4.1).velocity, 0.1);
}

TEST(TrapezoidProfile, IsATriangleWhereTheCruiseVelocityIsNotReached) {
  const TrapezoidProfile sut(0.02, 1.0, 0.5);
  EXPECT_DOUBLE_EQ(sut.duration(), 2 * std::sqrt(0.02 / 0.5));
  EXPECT_NEAR(sut.at(sut.duration() / 2).velocity, std::sqrt(0.02 * 0.5), 1e-15);
  EXPECT_NEAR(sut.at(sut.duration() / 2).position, 0.01, 1e-15);
}

TEST(TrapezoidProfile, RestsOutsideItsTime) {
  const TrapezoidProfile sut(0.8, 0.1, 0.5);
  for (double t : {-1.0, 0.0}) EXPECT_EQ(sut.at(t).position, 0);
  EXPECT_EQ(sut.at(100).position, 0.8);
  EXPECT_EQ(sut.at(100).velocity, 0);
  EXPECT_EQ(TrapezoidProfile(0, 0.1, 0.5).duration(), 0);
}

TEST(TrapezoidProfile, VelocityAndAccelerationAreTheDerivativesOfPosition) {
  constexpr unsigned kSeed = 3;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(0.05, 1.0);
  for (int trial = 0; trial < 100; ++trial) {
    const double v = uniform(random), a = uniform(random);
    const TrapezoidProfile sut(uniform(random), v, a);
    const double h = 1e-6;
    for (int i = 1; i < 50; ++i) {
      const double t = sut.duration() * i / 50;
      const ProfilePoint p = sut.at(t);
      EXPECT_NEAR((sut.at(t + h).position - sut.at(t - h).position) / (2 * h), p.velocity, 1e-6);
      EXPECT_LE(p.velocity, v + 1e-12);
      EXPECT_LE(std::abs(p.acceleration), a + 1e-12);
      EXPECT_NEAR(sut.at(t + h).velocity - sut.at(t - h).velocity, 2 * h * p.acceleration, 2.1 * h * a);
    }
  }
}

TEST(JointMove, IsAStraightLineInJointSpaceThatStartsAndStopsTogether) {
  JointVector from, to;
  from << 0, 0.1, 0.2, 0.3, 0.4;
  to << -0.5, 0.9, 0.2, 0.1, 0.4;
  const JointMove sut(from, to, 0.1, 0.5);
  EXPECT_DOUBLE_EQ(sut.duration(), 0.8 / 0.1 + 0.1 / 0.5);
  EXPECT_TRUE(sut.at(0).q.isApprox(from));
  EXPECT_TRUE(sut.at(sut.duration()).q.isApprox(to));
  for (double t = 0; t < sut.duration(); t += 0.1) {
    const MotionPoint p = sut.at(t);
    EXPECT_NEAR((p.q - from).dot(to - from), (p.q - from).norm() * (to - from).norm(), 1e-12);
    EXPECT_LE(p.velocity.cwiseAbs().maxCoeff(), 0.1 + 1e-12);
  }
}

TEST(JointMove, OfNoDistanceTakesNoTime) {
  const JointMove sut(JointVector::Ones(), JointVector::Ones(), 0.1, 0.5);
  EXPECT_EQ(sut.duration(), 0);
  EXPECT_EQ(sut.at(1).q, JointVector::Ones());
}

}  // namespace
}  // namespace tankrig
