// Moves and light by hand, planned and run on the mock rig.
#include "rig/plan/operator_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "rig/plan/motion_check.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/mock_rig.hpp"
#include "tests/support/temporary_folder.hpp"

using testing::HasSubstr;

namespace tankrig::testing_support {
namespace {

JointVector bent(const JointVector& from, double elbow) {
  JointVector q = from;
  q[kElbow] = elbow;
  return q;
}

/// A mock rig that runs any plan.
struct HandRig : MockRig {
  HandRig() { power_on(); }

  ScanResult run(const ScanPlan& a_plan, std::vector<ScanCamera> with = {}) {
    ScanJob job{a_plan, s, clock, *arm, *laser, std::move(with), sink, stop, interlock_closed, progress};
    return run_scan(job);
  }
};

TEST(MovePlan, GoesStraightWithinVelocityAccelerationAndJerkAndWithoutLight) {
  ScanSettings s;
  s.move.velocity = 0.2;
  s.move.acceleration = 0.4;
  const JointVector from = s.park;
  JointVector to = from;
  to << 0.3, 0.5, 1.0, -0.7, 0.2;
  const ScanPlan sut = make_move_plan(s, from, to, "move");
  EXPECT_FALSE(sut.uses_laser());
  EXPECT_EQ(sut.at(0).q, from);
  EXPECT_TRUE(sut.at(sut.duration()).q.isApprox(to));
  EXPECT_NEAR(sut.duration(), 1.0 / 0.2 + 0.2 / 0.4 + 0.4 / s.move.jerk + s.move.settle, 1e-9);
  for (double t = 0; t < sut.duration(); t += 0.01) {
    EXPECT_LE(sut.at(t).velocity.cwiseAbs().maxCoeff(), 0.2 + 1e-9);
    EXPECT_LE(sut.at(t).acceleration.cwiseAbs().maxCoeff(), 0.4 + 1e-9);
    EXPECT_LE((sut.at(t + 0.01).acceleration - sut.at(t).acceleration).cwiseAbs().maxCoeff(),
              0.01 * s.move.jerk + 1e-9);
  }
}

TEST(MovePlan, RefusesAVelocityThatIsNotPositive) {
  ScanSettings s;
  s.move.velocity = 0;
  EXPECT_THROW(make_move_plan(s, s.park, s.park, "move"), InputError);
}

TEST(MovePlan, AJointAtItsStopMayStartFromThereButGoNoFurther) {
  const ArmModel arm = arm5e();
  const auto refused = [&](double from, double to, double margin) {
    ScanSettings s;
    s.move.velocity = 0.05;
    JointVector now = JointVector::Zero();
    now << 0, 0.3, 1.0, 0, from;
    JointVector then = now;
    then[kJawOpening] = to;
    MotionLimits limits;
    limits.angle_margin = margin;
    Obstacles none;
    none.wMb = Transform(Eigen::Translation3d(0, 0, 5));
    none.tank_size = Vector3d(20, 20, 20);
    return message_of<InputError>([&] { check_motion(make_move_plan(s, now, then, "move"), arm, none, limits); });
  };
  const double stop = arm.limits[kJawOpening].upper;
  EXPECT_EQ(refused(stop + 0.01, stop - 0.3, 0), "no error");
  EXPECT_EQ(refused(stop - 0.01, stop - 0.3, 0.05), "no error") << "within the margin, but not beyond the stop";
  EXPECT_THAT(refused(stop + 0.01, stop + 0.015, 0), HasSubstr("joint jaw_opening"));
  EXPECT_THAT(refused(stop + 0.03, stop - 0.3, 0), HasSubstr("joint jaw_opening")) << "no stop is that soft";
  EXPECT_THAT(refused(stop - 0.3, stop - 0.01, 0.05), HasSubstr("joint jaw_opening"));
}

TEST(MoveByHand, ComesToRestWhereItWasAskedToWithTheInterlockOpenAndTheLaserUntouched) {
  HandRig rig;
  rig.interlock_closed = [] { return false; };
  const ScanResult result = rig.run(make_move_plan(rig.s, rig.s.park, bent(rig.s.park, 1.3), "move"));
  EXPECT_EQ(result.status, "complete");
  EXPECT_TRUE(result.left.safe());
  EXPECT_NEAR(rig.arm->truth_at(rig.clock.now())[kElbow], 1.3, 0.006);
  EXPECT_LT(rig.arm->true_velocity_at(rig.clock.now()).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_FALSE(rig.sink.told("laser", ""));
  EXPECT_TRUE(rig.sink.frames.empty());
}

TEST(MoveByHand, ThereAndBackEndsWhereItBegan) {
  HandRig rig;
  rig.run(make_move_plan(rig.s, rig.s.park, bent(rig.s.park, 1.3), "move"));
  const JointVector now = read_posture(*rig.arm, rig.clock, std::chrono::seconds{1});
  EXPECT_TRUE(rig.run(make_move_plan(rig.s, now, rig.s.park, "move to park")).complete());
  EXPECT_NEAR(rig.arm->truth_at(rig.clock.now())[kElbow], rig.s.park[kElbow], 0.006);
}

TEST(MoveByHand, AStopOnTheWayLeavesTheArmAtRestOnTheWay) {
  HandRig rig;
  rig.progress = [&](const ScanProgress& p) {
    if (p.fraction > 0.5) rig.stop = true;
  };
  const ScanResult result = rig.run(make_move_plan(rig.s, rig.s.park, bent(rig.s.park, 1.6), "move"));
  EXPECT_EQ(result.status, "stopped: asked for");
  EXPECT_TRUE(result.left.safe());
  const double elbow = rig.arm->truth_at(rig.clock.now())[kElbow];
  EXPECT_GT(elbow, 1.15);
  EXPECT_LT(elbow, 1.45);
  EXPECT_LT(rig.arm->true_velocity_at(rig.clock.now()).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(MoveByHand, ALaserThatIsOnIsAFault) {
  HandRig rig;
  ASSERT_TRUE(BenchRight::light(*rig.laser).ok());
  rig.laser->faults.stuck_on = true;
  const ScanResult result = rig.run(make_move_plan(rig.s, rig.s.park, bent(rig.s.park, 1.3), "move"));
  EXPECT_THAT(result.status, HasSubstr("laser: on though not commanded"));
  EXPECT_TRUE(result.left.arm_at_rest);
  EXPECT_FALSE(result.left.laser_dark);
}

TEST(PosturesPlan, RecordsInEveryPostureWithTheArmAtRestAndReturnsWithoutLight) {
  HandRig rig;
  rig.s.capture.dark_frames = 3;
  const std::vector<JointVector> postures{bent(rig.s.park, rig.s.park[kElbow] + 0.1), rig.s.park,
                                          bent(rig.s.park, rig.s.park[kElbow] + 0.2)};
  const ScanPlan plan = make_postures_plan(rig.s, rig.s.park, postures, 0.2);
  EXPECT_FALSE(plan.uses_laser());
  const ScanResult result = rig.run(plan, {{rig.cameras[0].get(), RecordWhen::kAll}});
  EXPECT_EQ(result.status, "complete");
  ASSERT_EQ(rig.sink.frames.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(rig.sink.frames[i].pass, static_cast<int>(i / 3));
    EXPECT_NEAR((*rig.sink.frames[i].q)[kElbow], postures[i / 3][kElbow], 1e-3) << i;
  }
  EXPECT_NEAR(plan.at(plan.duration()).q[kElbow], rig.s.park[kElbow], 1e-9);
  EXPECT_THROW(make_postures_plan(rig.s, rig.s.park, {}, 0.2), InputError);
}

TEST(LitHold, RecordsDarkFramesThenLitOnesAndTheArmStaysWhereItIs) {
  HandRig rig;
  rig.s.capture.laser_warm_up = 1.0;
  const ScanPlan plan = make_lit_hold_plan(rig.s, rig.s.park, 2.0);
  EXPECT_TRUE(plan.uses_laser());
  const ScanResult result = rig.run(plan, {{rig.cameras[0].get(), RecordWhen::kAll}});
  EXPECT_EQ(result.status, "complete");
  EXPECT_TRUE(result.left.safe());
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkBefore).size(), 5u);
  EXPECT_NEAR(rig.sink.of("mono", Phase::kSweep).size(), 50, 2);
  for (std::size_t i = 0; i < rig.sink.frames.size(); ++i) {
    EXPECT_EQ(rig.sink.pixels[i], rig.sink.frames[i].phase == Phase::kSweep ? 3 : 0) << i;
    EXPECT_NEAR((*rig.sink.frames[i].q)[kElbow], rig.s.park[kElbow], 1e-3);
  }
  EXPECT_EQ(rig.laser->power_at(rig.clock.now()), 0);
}

TEST(LitHold, IsRefusedWithTheInterlockOpen) {
  HandRig rig;
  rig.interlock_closed = [] { return false; };
  EXPECT_THROW(rig.run(make_lit_hold_plan(rig.s, rig.s.park, 2.0), {{rig.cameras[0].get(), RecordWhen::kAll}}),
               InputError);
  EXPECT_FALSE(rig.sink.told("laser", "on"));
}

TEST(LitHold, AStopTakesTheLightAway) {
  HandRig rig;
  rig.sink.on_frame = [&](const FrameRecord& f) {
    if (f.laser_on) rig.stop = true;
  };
  const ScanResult result =
      rig.run(make_lit_hold_plan(rig.s, rig.s.park, 60.0), {{rig.cameras[0].get(), RecordWhen::kAll}});
  EXPECT_EQ(result.status, "stopped: asked for");
  EXPECT_TRUE(result.left.safe());
  EXPECT_LT(result.simulated_s, 10);
}

}  // namespace
}  // namespace tankrig::testing_support
