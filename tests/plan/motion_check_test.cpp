#include "rig/plan/motion_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "core/input_error.hpp"
#include "rig/plan/operator_plan.hpp"
#include "tests/plan/bent_elbow_scan.hpp"
#include "tests/support/temporary_folder.hpp"

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

TEST(MotionCheck, AcceptsASweepWithRoomAroundItAndSaysHowMuch) {
  const MotionCheck sut = check(bent_elbow_scan(), tank());
  EXPECT_GT(sut.nearest().clearance, 0.02);
  EXPECT_LT(sut.nearest().clearance, 1.2);
  EXPECT_FALSE(sut.nearest().pair.empty());
  EXPECT_FALSE(sut.nearest().segment.empty());
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
  Box box{Transform(Eigen::Translation3d(arm.bMe(q).translation())), Vector3d(0.14, 0.30, 0.16)};
  o.fixed = {{"black box", box}};
  expect_refused(bent_elbow_scan(), o, {"black box", "forearm", "mm", "expected at least"});
  box.xMbox.translation() += Vector3d(0, 0.6, 0);
  o.fixed = {{"black box", box}};
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
  o.tool_length = bare.nearest_of[static_cast<std::size_t>(PairKind::kTank)].clearance + 0.3;
  expect_refused(bent_elbow_scan(), o, {"forearm"});
  o = tank();
  o.carried.push_back({"projector", Capsule{{-0.1, 0, -0.2}, {-1.5, 0, -0.2}, 0.03}});
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
    o.fixed = {{"pin", Box{Transform(Eigen::Translation3d(tip)), Vector3d::Constant(0.003)}}};
    EXPECT_THROW(check_motion(plan, arm, o, limits), InputError) << i;
  }
}

TEST(MotionCheck, ReportsTheClearanceThatGeometryGives) {
  ScanSettings s = bent_elbow_scan();
  s.park = s.posture;  // the elbow only
  s.park[kElbow] = s.sweep.from;
  Obstacles o = tank();
  o.tank_size = {4, 4, 1.5};  // the floor is nearest
  const ScanPlan plan = make_scan_plan(s, s.park);
  const MotionCheck sut = check_motion(plan, arm5e(), o, kNoMargin);
  double lowest = 1e9;
  for (double t = 0; t < plan.duration(); t += 0.002) {
    const auto frames = arm5e().link_frames(plan.at(t).q);
    for (const Transform& f : frames) lowest = std::min(lowest, (o.wMb * f.translation()).z() - o.link_radius);
  }
  const Approach& floor = sut.nearest_of[static_cast<std::size_t>(PairKind::kTank)];
  EXPECT_EQ(floor.pair, "floor: forearm");
  EXPECT_NEAR(floor.clearance, lowest, kClearanceAccuracy);
}

TEST(MotionCheck, RefusesACameraInTheWayAndNamesPairDistancePostureSegmentAndTime) {
  Obstacles o = tank();
  JointVector q = bent_elbow_scan().posture;
  q[kElbow] = 1.7;
  // 30 mm beside the forearm's skin where it passes: more than the margin of 20; then 10 mm.
  const Vector3d tip = arm5e().bMe(q).translation();
  const auto with_camera_beside = [&](double room) {
    o.cameras = {
        {"mono",
         {Transform(Eigen::Translation3d(tip + Vector3d(0, 0.045 + room + 0.03, 0))), Vector3d::Constant(0.06)}}};
    return o;
  };
  const MotionCheck sut = check(bent_elbow_scan(), with_camera_beside(0.03));
  EXPECT_NEAR(sut.nearest_of[static_cast<std::size_t>(PairKind::kCamera)].clearance, 0.03, kClearanceAccuracy);
  expect_refused(bent_elbow_scan(), with_camera_beside(0.01),
                 {"motion refused: camera mono: forearm comes within 10.",
                  " mm, expected at least 20.0 mm, at slew 0.0, ", " deg, in \"", "\" at "});
}

TEST(MotionCheck, RefusesAFoldedArmWhoseForearmMeetsItsBase) {
  ArmModel arm = arm5e();
  arm.limits[kElbow].upper = 3.2;  // ours ends at 2.15, which keeps them apart
  const ScanSettings s = bent_elbow_scan();
  JointVector from = s.posture;
  from[kElbow] = 1.3;
  JointVector to = from;
  to[kElbow] = 3.0;
  const std::string refused =
      message_of<InputError>([&] { check_motion(make_move_plan(s, from, to, "fold"), arm, tank(), kNoMargin); });
  EXPECT_THAT(refused, testing::HasSubstr("base: forearm comes within"));
  to[kElbow] = 2.15;
  EXPECT_NO_THROW(check_motion(make_move_plan(s, from, to, "fold"), arm, tank(), kNoMargin));
}

TEST(MotionCheck, FindsOfEachKindWhatADenseLookFinds) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const ArmModel arm = arm5e();
  ScanSettings s = bent_elbow_scan();
  s.move.velocity = 0.1;
  for (int trial = 0; trial < 20; ++trial) {
    Obstacles o = tank();
    o.margin = -1;  // whatever comes, it is told
    o.carried = {{"projector", Capsule{{-0.1, 0, -0.33}, {-0.1, 0, -0.2}, 0.03}}};
    const auto somewhere = [&] {
      return Transform(
          make_transform_rpy({0.5 + 0.4 * uniform(random), 0.4 * uniform(random), 0.4 + 0.3 * uniform(random)},
                             {uniform(random), uniform(random), uniform(random)}));
    };
    o.cameras = {{"left", {somewhere(), {0.06, 0.08, 0.1}}}, {"right", {somewhere(), {0.06, 0.08, 0.1}}}};
    o.fixed = {{"box", Box{somewhere(), {0.2, 0.05, 0.3}}},
               {"bar", Capsule{somewhere().translation(), somewhere().translation(), 0.02}}};
    JointVector from, to;
    from << 0.5 * uniform(random), 0.5 + 0.4 * uniform(random), 1 + 0.9 * uniform(random), uniform(random), 0.1;
    to << 0.5 * uniform(random), 0.5 + 0.4 * uniform(random), 1 + 0.9 * uniform(random), uniform(random), 0.1;
    const ScanPlan plan = make_move_plan(s, from, to, "move");
    const MotionCheck sut = check_motion(plan, arm, o, kNoMargin);
    const Clearance clearance(arm, o);
    std::array<double, kPairKindNames.size()> dense;
    dense.fill(1e9);
    for (double t = 0; t <= plan.duration(); t += 0.01)
      for (std::size_t pair = 0; pair < clearance.pairs(); ++pair) {
        double& least = dense[static_cast<std::size_t>(clearance.kind(pair))];
        least = std::min(least, clearance.at(pair, plan.at(t).q));
      }
    for (const PairKind kind : {PairKind::kTank, PairKind::kCamera, PairKind::kFrame, PairKind::kArm}) {
      const Approach& found = sut.nearest_of[static_cast<std::size_t>(kind)];
      EXPECT_LE(found.clearance, dense[static_cast<std::size_t>(kind)] + kClearanceAccuracy) << trial << found.pair;
      EXPECT_TRUE(plan.at(found.when).q.isApprox(found.q, 1e-12)) << "the posture is the plan's";
    }
  }
}

}  // namespace
}  // namespace tankrig
