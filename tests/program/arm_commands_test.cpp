// `tankrig arm` as a user meets it, on the simulated tank.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

constexpr double kParkElbowDeg = 51.566;  // park_rad of the tank-sim rig: 0.9

const nlohmann::json& joint_of(const nlohmann::json& report, const std::string& name) {
  for (const auto& joint : report.at("joints"))
    if (joint.at("name") == name) return joint;
  throw std::runtime_error("no joint " + name);
}

TEST(ArmStatus, TellsJointsTicksCurrentAndHoming) {
  const ProgramRun run = run_tankrig({"arm", "status", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto report = run.json();
  EXPECT_EQ(report.at("rig"), "tank-sim");
  EXPECT_EQ(report.at("homed"), true);
  EXPECT_EQ(report.at("at_rest"), true);
  ASSERT_EQ(report.at("joints").size(), 5u);
  const auto elbow = joint_of(report, "elbow");
  EXPECT_NEAR(elbow.at("angle_deg").get<double>(), kParkElbowDeg, 0.05);
  EXPECT_NEAR(elbow.at("angle_rad").get<double>(), 0.9, 0.001);
  EXPECT_GT(elbow.at("ticks").get<int>(), 1000);
  EXPECT_EQ(elbow.at("velocity_deg_s").get<double>(), 0);
  EXPECT_NEAR(elbow.at("upper_deg").get<double>(), 123.35, 0.01);
  EXPECT_NEAR(report.at("exchange_period_s").get<double>(), 0.01, 1e-9);
  EXPECT_NEAR(report.at("states").get<int>(), 50, 2);
  EXPECT_TRUE(report.at("statistics").is_object());
}

TEST(ArmStatus, IsOneTableForPeople) {
  const ProgramRun run = run_tankrig({"arm", "status"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* words : {"slew", "shoulder", "elbow", "jaw_rotate", "jaw_opening", "51.57 deg", "0.9000 rad",
                            "homed", "at rest", "supply current", "every 10.00 ms"})
    EXPECT_THAT(run.out, HasSubstr(words));
}

TEST(ArmJog, MovesTheJointAskedForByAnAngleAndNoOther) {
  const ProgramRun run = run_tankrig({"arm", "jog", "elbow", "-5", "--relative", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto report = run.json();
  EXPECT_EQ(report.at("status"), "complete");
  EXPECT_EQ(report.at("laser_dark"), true);
  EXPECT_EQ(report.at("arm_at_rest"), true);
  for (const auto& joint : report.at("joints")) {
    const double way = joint.at("reached_deg").get<double>() - joint.at("from_deg").get<double>();
    if (joint.at("name") == "elbow")
      EXPECT_NEAR(way, -5, 0.3);
    else
      EXPECT_NEAR(way, 0, 0.05) << joint.at("name");
  }
  // 5 deg at 0.1 rad/s, and the ramps: neither at once nor for ever.
  EXPECT_GT(report.at("duration_s").get<double>(), 5 / 5.73);
  EXPECT_LT(report.at("duration_s").get<double>(), 4);
  EXPECT_THAT(run.err, HasSubstr("arm: move elbow"));
}

TEST(ArmJog, GoesToAnAngleAtAVelocity) {
  const ProgramRun slow = run_tankrig({"arm", "jog", "slew", "-30", "--velocity", "4", "--json"});
  const ProgramRun fast = run_tankrig({"arm", "jog", "slew", "-30", "--velocity", "8", "--json"});
  ASSERT_EQ(slow.exit_code, 0) << slow.err;
  ASSERT_EQ(fast.exit_code, 0) << fast.err;
  EXPECT_NEAR(joint_of(slow.json(), "slew").at("reached_deg").get<double>(), -30, 0.3);
  EXPECT_NEAR(slow.json().at("duration_s").get<double>() - fast.json().at("duration_s").get<double>(), 30. / 8, 0.3);
}

TEST(ArmJog, EveryJointMovesAtItsDefaultVelocity) {
  for (const std::string joint : {"slew", "shoulder", "elbow", "jaw_rotate", "jaw_opening"}) {
    const ProgramRun run = run_tankrig({"arm", "jog", joint, "3", "--relative", "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto moved = joint_of(run.json(), joint);
    // A joint comes to rest where its correction falls below half its dead zone: 0.95 deg for jaw_rotate.
    EXPECT_NEAR(moved.at("reached_deg").get<double>() - moved.at("from_deg").get<double>(), 3, 1) << joint;
  }
}

TEST(ArmJog, ADryRunTellsTheClearanceAndMovesNothing) {
  const ProgramRun run = run_tankrig({"arm", "jog", "shoulder", "60", "--dry-run", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json().at("status"), "checked");
  EXPECT_GT(run.json().at("clearance_m").get<double>(), 0.02);
  EXPECT_FALSE(joint_of(run.json(), "shoulder").contains("reached_deg"));
}

TEST(ArmJog, BeyondALimitIsRefusedWithJointAndLimit) {
  const ProgramRun run = run_tankrig({"arm", "jog", "elbow", "124"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("motion refused: joint elbow"));
  EXPECT_THAT(run.err, HasSubstr("2.1529"));
  EXPECT_EQ(run.out, "");
}

TEST(ArmJog, IntoACameraIsRefusedWithPairDistanceAndPosture) {
  const ProgramRun run = run_tankrig({"arm", "jog", "slew", "10"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("motion refused: camera right: forearm comes within"));
  EXPECT_THAT(run.err, HasSubstr("shoulder 7.4"));
  EXPECT_EQ(run.out, "");
}

TEST(ArmJog, ThroughAnObstacleIsRefusedWithWhatIsHit) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "bMo: {translation_m: [-0.26, 0.025, 1.02]",
                                  "bMo: {translation_m: [0.45, 0.0, 0.6]");
  const ProgramRun run = run_tankrig({"arm", "jog", "--rig", rig.string(), "elbow", "100"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("object"));
  EXPECT_THAT(run.err, HasSubstr("comes within"));
}

TEST(ArmJog, AVelocityTheArmCannotKeepIsRefusedWithTheLimit) {
  const ProgramRun slow = run_tankrig({"arm", "jog", "elbow", "1", "--velocity", "1"});
  EXPECT_EQ(slow.exit_code, 1);
  EXPECT_THAT(slow.err, HasSubstr("at least 3.44"));
  const ProgramRun fast = run_tankrig({"arm", "jog", "elbow", "90", "--velocity", "100"});
  EXPECT_EQ(fast.exit_code, 1);
  EXPECT_THAT(fast.err, HasSubstr("motion refused"));
}

TEST(ArmPark, MovesEveryJointToTheRigFilesPosture) {
  const ProgramRun run = run_tankrig({"arm", "park", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NEAR(joint_of(run.json(), "elbow").at("asked_deg").get<double>(), kParkElbowDeg, 0.01);
  EXPECT_NEAR(joint_of(run.json(), "elbow").at("reached_deg").get<double>(), kParkElbowDeg, 0.3);
}

TEST(ArmHome, SaysThatTheSimulatedArmNeedsNone) {
  const ProgramRun run = run_tankrig({"arm", "home"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("needs no homing"));
}

TEST(Arm, WrongWordsAreExitCodeTwo) {
  EXPECT_EQ(run_tankrig({"arm"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"arm", "jog", "nose", "3"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"arm", "jog", "elbow"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"arm", "jog", "elbow", "up"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"arm", "jog", "elbow", "3", "--velocity", "-1"}).exit_code, 2);
}

TEST(Arm, StopSaysWhatIsConfirmed) {
  const ProgramRun run = run_tankrig({"arm", "stop", "--json"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.json().at("laser_dark"), true);
  EXPECT_EQ(run.json().at("arm_at_rest"), true);
}

TEST(Arm, AnAngleThatIsNoNumberIsRefused) {
  for (const char* angle : {"nan", "inf"}) {
    const ProgramRun run = run_tankrig({"arm", "jog", "elbow", angle});
    EXPECT_NE(run.exit_code, 0) << angle;
    EXPECT_EQ(run.out, "") << angle;
  }
}

TEST(Arm, ExplainsItselfWithExamples) {
  for (const char* command : {"home", "jog", "park", "status", "stop"}) {
    const ProgramRun run = run_tankrig({"arm", command, "--help"});
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, HasSubstr(std::string("Example: tankrig arm ") + command));
  }
}

}  // namespace
}  // namespace tankrig::test
