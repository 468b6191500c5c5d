// The arm's kinematics and actuators against published values and their own inverses.
#include "core/arm_model.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

JointVector joints(double slew, double shoulder, double elbow, double roll = 0, double jaw = 0) {
  JointVector q;
  q << slew, shoulder, elbow, roll, jaw;
  return q;
}

TEST(ArmModel, ReachesThePublishedEndEffectorPositions) {
  const ArmModel sut = arm5e();
  EXPECT_LT((sut.bMe(joints(0, 0.12, 0.9)).translation() - Vector3d(0.597, 0, 0.662)).norm(), 1e-3);
  EXPECT_LT((sut.bMe(joints(0, 0.12, 1.8)).translation() - Vector3d(0.134, 0, 0.524)).norm(), 1e-3);
  EXPECT_LT((sut.bMe(joints(0, 0, 0)).translation() - Vector3d(1.033, 0, 0.273)).norm(), 1e-3);
}

TEST(ArmModel, SlewTurnsTheWholeArmAboutTheBaseAxis) {
  const ArmModel sut = arm5e();
  const Vector3d ahead = sut.bMe(joints(0, 0.2, 1.1)).translation();
  const Vector3d turned = sut.bMe(joints(-0.7, 0.2, 1.1)).translation();
  EXPECT_LT((Eigen::AngleAxisd(-0.7, Vector3d::UnitZ()) * ahead - turned).norm(), 1e-12);
}

TEST(ArmModel, RollTurnsTheToolAboutItsOwnAxisAndMovesNothing) {
  const ArmModel sut = arm5e();
  const Transform a = sut.bMe(joints(0.1, 0.2, 1.1, 0)), b = sut.bMe(joints(0.1, 0.2, 1.1, 0.8));
  EXPECT_LT((a.translation() - b.translation()).norm(), 1e-12);
  EXPECT_LT((a.linear().col(2) - b.linear().col(2)).norm(), 1e-12);
}

TEST(Actuator, TicksAndAngleAreInverseOverEveryAxisRange) {
  const ArmModel arm = arm5e();
  for (int axis = 0; axis < kJoints; ++axis)
    for (int i = 0; i <= 100; ++i) {
      const double q = arm.limits[axis].lower + (arm.limits[axis].upper - arm.limits[axis].lower) * i / 100;
      EXPECT_NEAR(arm.actuators[axis].angle(arm.actuators[axis].ticks(q)), q, 1e-9) << kJointNames[axis];
    }
}

TEST(Actuator, ResolutionIsTheSlopeOfTheAngle) {
  const ArmModel arm = arm5e();
  for (int axis = 0; axis < kJoints; ++axis) {
    const Actuator& sut = arm.actuators[axis];
    const double q = 0.5 * (arm.limits[axis].lower + arm.limits[axis].upper), t = sut.ticks(q);
    EXPECT_NEAR(sut.resolution(q), std::abs(sut.angle(t + 0.5) - sut.angle(t - 0.5)), 1e-9) << kJointNames[axis];
  }
}

TEST(Actuator, ElbowHasThePublishedTravelAndResolution) {
  const Actuator elbow = arm5e().actuators[kElbow];
  EXPECT_NEAR(std::abs(elbow.ticks(0) - elbow.ticks(2.15294)), 16926, 30);
  EXPECT_NEAR(elbow.resolution(0.6), 0.000103, 0.00003);
}

}  // namespace
}  // namespace tankrig
