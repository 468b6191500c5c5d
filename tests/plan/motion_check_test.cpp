#include "rig/plan/motion_check.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "core/input_error.hpp"
#include "tests/plan/bent_elbow_scan.hpp"

namespace tankrig {
namespace {

/// The arm's base 1.2 m above the floor's centre, its z down.
Obstacles tank() {
  Obstacles o;
  o.wMb = make_transform_rpy({0, 0, 1.2}, {std::numbers::pi, 0, 0});
  return o;
}

const MotionLimits kNoMargin{.angle_margin = 0};

MotionCheck check(const ScanSettings& s, const Obstacles& o, const MotionLimits& limits = kNoMargin) {
  return check_motion(make_scan_plan(s, s.park), arm5e(), o, limits);
}

void expect_refused(const ScanSettings& s, const Obstacles& o, const std::vector<std::string>& words,
                    const MotionLimits& limits = kNoMargin) {
  try {
    check(s, o, limits);
    FAIL() << "accepted, expected a word about " << words.front();
  } catch (const InputError& e) {
    for (const std::string& word : words) EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

TEST(SegmentBoxDistance, AgreesWithDenseSampling) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto point = [&] { return Vector3d(uniform(random), uniform(random), uniform(random)); };
  for (int trial = 0; trial < 200; ++trial) {
    ObstacleBox box{"box", make_transform_rpy(point() * 0.5, point() * 3), Vector3d(0.07, 0.15, 0.08)};
    const Vector3d a = point(), b = point();
    double sampled = 1e9;
    for (int i = 0; i <= 2000; ++i) {
      const Vector3d p = box.bMx.inverse() * Vector3d(a + (b - a) * i / 2000.0);
      sampled = std::min(sampled, (p.cwiseAbs() - box.half_size).cwiseMax(0.0).norm());
    }
    EXPECT_NEAR(distance(a, b, box), sampled, 1e-3);
    EXPECT_LE(distance(a, b, box), sampled + 1e-9);
  }
}

TEST(SegmentBoxDistance, IsExactForAParallelSegmentAndZeroInside) {
  const ObstacleBox box{"box", Transform::Identity(), Vector3d(0.1, 0.1, 0.1)};
  EXPECT_NEAR(distance({-1, 0, 0.4}, {1, 0, 0.4}, box), 0.3, 1e-12);
  EXPECT_NEAR(distance({0.4, 0.5, 0}, {0.4, 0.9, 0}, box), 0.5, 1e-9);
  EXPECT_NEAR(distance({-1, 0, 0}, {1, 0, 0}, box), 0, 1e-12);
}

TEST(MotionCheck, AcceptsASweepWithRoomAroundItAndSaysHowMuch) {
  const MotionCheck sut = check(bent_elbow_scan(), tank());
  EXPECT_GT(sut.min_clearance, 0.02);
  EXPECT_LT(sut.min_clearance, 1.2);
  EXPECT_FALSE(sut.nearest.empty());
  EXPECT_FALSE(sut.where.empty());
}

TEST(MotionCheck, RefusesAnAngleOutsideItsLimitByJointValueAndPlace) {
  ScanSettings s = bent_elbow_scan();
  s.sweep.to = 2.15;
  expect_refused(s, tank(), {"elbow", "2.1529", "sweep pass 0"});
  s = bent_elbow_scan();
  s.posture[kSlew] = 0.7;
  expect_refused(s, tank(), {"slew", "0.5488"});
}

TEST(MotionCheck, KeepsAMarginFromTheLimitsIfAsked) {
  expect_refused(bent_elbow_scan(), tank(), {"elbow"}, {.angle_margin = 0.05});
}

TEST(MotionCheck, RefusesWhatTheActuatorCannotDo) {
  ScanSettings s = bent_elbow_scan();
  s.move.velocity = 0.9;
  s.move.acceleration = 5;
  expect_refused(s, tank(), {"ticks/s"});
  s.move.velocity = 1.5;
  s.park[kElbow] = 0;
  expect_refused(s, tank(), {"rad/s"});
}

TEST(MotionCheck, RefusesAPathThroughTheBox) {
  const ArmModel arm = arm5e();
  JointVector q = bent_elbow_scan().posture;
  q[kElbow] = 1.7;
  Obstacles o = tank();
  o.boxes.push_back(
      {"black box", Transform(Eigen::Translation3d(arm.bMe(q).translation())), Vector3d(0.07, 0.15, 0.08)});
  expect_refused(bent_elbow_scan(), o, {"black box", "forearm", "mm", "expected at least"});
  o.boxes[0].bMx.translation() += Vector3d(0, 0.6, 0);
  EXPECT_NO_THROW(check(bent_elbow_scan(), o));
}

TEST(MotionCheck, RefusesAPathThroughFloorOrWall) {
  Obstacles o = tank();
  o.wMb.translation().z() = 0.6;
  expect_refused(bent_elbow_scan(), o, {"floor"});
  o = tank();
  o.wMb.translation().x() = 0.5;
  expect_refused(bent_elbow_scan(), o, {"wall +x"});
  o = tank();
  o.tank_size.y() = 0.1;
  expect_refused(bent_elbow_scan(), o, {"wall", "y"});
}

TEST(MotionCheck, LooksAtTheProjectorAndTheToolToo) {
  Obstacles o = tank();
  const MotionCheck bare = check(bent_elbow_scan(), o);
  o.tool_length = bare.min_clearance + 0.3;
  expect_refused(bent_elbow_scan(), o, {"forearm"});
  o = tank();
  o.carried.push_back({{-0.1, 0, -0.2}, {-1.5, 0, -0.2}, 0.03});
  expect_refused(bent_elbow_scan(), o, {"projector"});
}

TEST(MotionCheck, MissesNoObstacleOfAFewMillimetresOnAFastPath) {
  ScanSettings s = bent_elbow_scan();
  s.sweep.from = 1.3;
  s.sweep.to = 1.6;
  s.sweep.velocity = 0.5;
  s.sweep.acceleration = 2;
  MotionLimits limits = kNoMargin;
  limits.max_ticks_per_s = 1e6;
  Obstacles o = tank();
  o.link_radius = 0;
  o.margin = 0.001;
  const ArmModel arm = arm5e();
  JointVector q = s.posture;
  q[kElbow] = 1.0;
  s.park = s.posture;
  s.park[kElbow] = 1.8;
  const ScanPlan plan = make_scan_plan(s, q);  // passes the pins once, in the sweep
  for (int i = 0; i < 100; ++i) {
    q[kElbow] = 1.4 + 0.001 * i;
    const Vector3d tip = arm.bMe(q) * Vector3d(0, 0, 0.001);  // only the tip itself comes so near
    o.boxes = {{"pin", Transform(Eigen::Translation3d(tip)), Vector3d::Constant(0.0015)}};
    EXPECT_THROW(check_motion(plan, arm, o, limits), InputError) << i;
  }
}

TEST(MotionCheck, ReportsTheClearanceThatGeometryGives) {
  ScanSettings s = bent_elbow_scan();
  s.park = s.posture;  // the elbow only
  s.park[kElbow] = s.sweep.from;
  const Obstacles o = tank();
  const ScanPlan plan = make_scan_plan(s, s.park);
  const MotionCheck sut = check_motion(plan, arm5e(), o, kNoMargin);
  double lowest = 1e9;
  for (double t = 0; t < plan.duration(); t += 0.002) {
    const auto frames = arm5e().link_frames(plan.at(t).q);
    for (const Transform& f : frames) lowest = std::min(lowest, (o.wMb * f.translation()).z() - o.link_radius);
  }
  if (sut.nearest.find("floor") != std::string::npos) {
    EXPECT_NEAR(sut.min_clearance, lowest, 1e-4);
  }
  EXPECT_LE(sut.min_clearance, lowest + 1e-4);
}

}  // namespace
}  // namespace tankrig
