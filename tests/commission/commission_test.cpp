// Each step of the start-up test, passed and failed.
#include "rig/commission/commission.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/capture/beam_view.hpp"
#include "rig/plan/operator_plan.hpp"
#include "rig/scan/before_start.hpp"
#include "sim_backends/wire/box_emulator.hpp"
#include "tests/commission/commission_bench.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing_support::CommissionBench;
using Bench = CommissionBench<VirtualClock>;
using Step = CommissionStep;
using Verdict = CommissionVerdict;

const CommissionFinding& of(const std::vector<CommissionFinding>& found, Step step) {
  return found.at(static_cast<std::size_t>(step));
}
std::string verdict(const std::vector<CommissionFinding>& found, Step step) {
  EXPECT_EQ(of(found, step).step, step);
  return name_of(of(found, step).verdict);
}

TEST(Commission, TriesEveryStepAndFindsAHealthyRigWell) {
  Bench bench;
  const auto found = bench.run();
  ASSERT_EQ(found.size(), kNames<Step>.size());
  for (const Step step : {Step::kDisk, Step::kEncoders, Step::kBeam, Step::kLid, Step::kRelayWatchdog})
    EXPECT_EQ(verdict(found, step), "passed") << name_of(step) << ": " << of(found, step).measured;
  EXPECT_THAT(of(found, Step::kRelayWatchdog).measured, HasSubstr("open 1000 ms after its last refresh"));
  EXPECT_THAT(bench.asked, ElementsAre(Deed::kOpenLid, Deed::kCloseLid));
  EXPECT_EQ(verdict(found, Step::kEnable), "failed") << "it has no box";
  EXPECT_THAT(of(found, Step::kEnable).measured, HasSubstr("names no enable_input"));
}

TEST(Commission, TriesTheBeamWhereACameraSeesIt) {
  const RigConfig rig = Bench().rig;
  const JointVector middle = commission_posture(rig, rig.scan.park);
  EXPECT_TRUE(stripe_in_view(rig, rig.cameras[0])(middle));
  EXPECT_FALSE(stripe_in_view(rig, rig.cameras[0])(rig.scan.park)) << "else that says nothing";
  JointVector near_it = middle;
  near_it[kElbow] += 0.05;
  EXPECT_EQ(commission_posture(rig, near_it), near_it);
}

/// The arm is elsewhere.
void send(Bench& bench) {
  const JointVector from = bench.posture;
  bench.posture[kElbow] += 0.2;
  bench.way = make_move_plan(bench.rig.scan, from, bench.posture, "way");
}

TEST(Commission, GoesToWhereTheBeamIsTriedFirst) {
  Bench bench;
  send(bench);
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kBeam), "passed") << of(found, Step::kBeam).measured;
  EXPECT_NEAR(read_posture(bench.arm, bench.clock, 1s)[kElbow], bench.posture[kElbow], 0.02);
}

TEST(Commission, TriesNothingMoreIfItDoesNotGetThere) {
  Bench bench;
  send(bench);
  bench.rig.scan.control.following_error_limit = 1e-6;
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kEncoders), "passed");
  for (const Step step : {Step::kBeam, Step::kLid, Step::kRelayWatchdog, Step::kEnable})
    EXPECT_THAT(of(found, step).measured, HasSubstr("not tried: the arm did not get to where the beam is tried: "));
  EXPECT_THAT(bench.asked, IsEmpty());
}

TEST(Commission, LeavesOutWhatIsWaived) {
  Bench bench;
  bench.waived = {Step::kLid, Step::kRelayWatchdog, Step::kEnable};
  bench.laser.watchdog.reset();
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kBeam), "passed") << of(found, Step::kBeam).measured;
  for (const Step step : bench.waived) EXPECT_EQ(verdict(found, step), "waived");
  EXPECT_THAT(bench.asked, IsEmpty());
}

TEST(Commission, TakesTheDisksFinding) {
  Bench bench;
  const auto found = bench.run({Step::kDisk, Verdict::kFailed, "full"});
  EXPECT_EQ(verdict(found, Step::kDisk), "failed");
  EXPECT_EQ(verdict(found, Step::kEncoders), "passed");
}

TEST(Commission, FailsForARelayWithoutAWatchdogOrASlowOne) {
  for (const auto& watchdog : {std::optional<Duration>{}, std::optional<Duration>{3s}}) {
    Bench bench;
    bench.laser.watchdog = watchdog;
    bench.waived = {Step::kBeam, Step::kLid, Step::kEnable};
    const auto found = bench.run();
    EXPECT_EQ(verdict(found, Step::kRelayWatchdog), "failed");
    EXPECT_THAT(of(found, Step::kRelayWatchdog).measured,
                HasSubstr(watchdog ? "expected at most 2 s" : "it has no watchdog"));
    EXPECT_FALSE(bench.laser.state().value().commanded);
  }
}

TEST(Commission, FailsForABeamThatNoCameraSees) {
  Bench bench;
  bench.lamp.set_beam(sim::MockBeam::kDark);
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kBeam), "failed");
  EXPECT_THAT(of(found, Step::kBeam).measured, HasSubstr("a stripe in 0 of"));
  EXPECT_EQ(verdict(found, Step::kLid), "failed") << "it is not opened before the beam is seen";
  EXPECT_THAT(bench.asked, IsEmpty());
}

TEST(Commission, FailsForABeamThatIsAlwaysThere) {
  Bench bench;
  bench.lamp.set_beam(sim::MockBeam::kStuck);
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kBeam), "failed") << "it was learnt as the dark";
}

TEST(Commission, FailsWhereNoCameraHasTheStripeInView) {
  Bench bench;
  bench.rig.cameras[0].bMc.translation().x() += 10;
  const auto found = bench.run();
  EXPECT_THAT(of(found, Step::kBeam).measured, HasSubstr("no camera that testifies has the stripe in view"));
  EXPECT_EQ(verdict(found, Step::kLid), "passed") << of(found, Step::kLid).measured;
}

TEST(Commission, FailsForALidThatNobodyOpensOrWhoseOpeningIsNotSeen) {
  Bench bench;
  bench.refused = {Deed::kOpenLid};
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kBeam), "passed") << of(found, Step::kBeam).measured;
  EXPECT_EQ(verdict(found, Step::kLid), "failed");
  EXPECT_THAT(of(found, Step::kLid).measured, HasSubstr("asked to open it: complete"));
  EXPECT_THAT(bench.asked, Contains(Deed::kOpenLid));
}

TEST(Commission, FailsForALidThatIsNotClosedAgainAndThenNothingShines) {
  Bench bench;
  bench.refused = {Deed::kCloseLid};
  const auto found = bench.run();
  EXPECT_THAT(of(found, Step::kLid).measured, HasSubstr("not closed again"));
  EXPECT_EQ(verdict(found, Step::kRelayWatchdog), "failed");
  EXPECT_THAT(of(found, Step::kRelayWatchdog).measured, HasSubstr("interlock: found open"));
}

TEST(Commission, FailsForALaserThatGoesOnThoughTheLidIsOpen) {
  Bench bench;
  bench.waived = {Step::kBeam, Step::kEnable};
  bench.lamp.faults.stuck_on = true;
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kLid), "failed");
  EXPECT_THAT(of(found, Step::kLid).measured, HasSubstr("LASER MAY BE ON"));
  EXPECT_THAT(of(found, Step::kRelayWatchdog).measured, HasSubstr("not tried: laser off and arm at rest were not"));
}

TEST(Commission, FailsForAWiredInterlockThatItCannotSee) {
  Bench bench;
  bench.reads_interlock = false;
  const auto found = bench.run();
  EXPECT_THAT(of(found, Step::kLid).measured, HasSubstr("wired interlock"));
  EXPECT_EQ(verdict(found, Step::kBeam), "passed") << of(found, Step::kBeam).measured;
}

TEST(Commission, FailsForAnEncoderThatIsBeyondItsJointsLimit) {
  Bench bench;
  bench.rig.arm.limits[kElbow].upper = bench.posture[kElbow] - 0.2;
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kEncoders), "failed");
  EXPECT_THAT(of(found, Step::kEncoders).measured, HasSubstr("elbow at"));
  EXPECT_EQ(of(found, Step::kBeam).measured, "not tried: the encoders are in doubt");
}

TEST(Commission, FailsForAnArmThatMovesThoughNobodyMovesIt) {
  Bench bench;
  JointVector velocity = JointVector::Zero();
  velocity[kElbow] = 0.1;
  ASSERT_TRUE(drive(bench.arm, velocity).ok());
  bench.arm.faults.runs_away = true;
  const auto found = bench.run();
  EXPECT_THAT(of(found, Step::kEncoders).measured, HasSubstr("elbow flickers over"));
}

TEST(Commission, EndsWhenItIsStopped) {
  Bench bench;
  bench.stop = true;
  const auto found = bench.run();
  for (const Step step : {Step::kEncoders, Step::kBeam, Step::kLid, Step::kRelayWatchdog, Step::kEnable})
    EXPECT_EQ(of(found, step).measured, "not tried: stopped");
}

/// With a box, in real time: somebody presses its button.
struct BoxedBench : CommissionBench<MonotonicClock> {
  TemporaryFolder folder;
  sim::BoxEmulator emulator{{.name = folder.path() / "box", .reset_after = 50ms}, [](bool) {}};
  WatchdogBox the_box{{.heartbeat = {.kind = HeartbeatKind::kBytes, .device = folder.path() / "box"},
                       .enable = {.kind = EnableKind::kReply}},
                      "/",
                      clock};
  BoxedBench() {
    box = &the_box;
    press_stop = [this](bool pressed) { emulator.press_stop(pressed); };
    waived = {Step::kBeam, Step::kLid, Step::kRelayWatchdog};
    rig.scan.safety.heartbeat_output.kind = HeartbeatKind::kBytes;
    rig.scan.real_time.required = false;
    rig.scan.real_time.overruns = 0;
    rig.scan.control.feedback_timeout = rig.scan.control.heartbeat_timeout = 5;  // a busy machine is not what is tested
  }
};

TEST(Commission, PressesTheStopWhileTheArmMovesAndSeesItAtRest) {
  BoxedBench bench;
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kEnable), "passed") << of(found, Step::kEnable).measured;
  EXPECT_THAT(of(found, Step::kEnable).measured,
              HasSubstr("stop pressed while the elbow moved, box open, arm at rest"));
  EXPECT_THAT(bench.asked, ElementsAre(Deed::kPressStop, Deed::kReleaseStop));
}

TEST(Commission, SeesTheLidsOwnContactAlsoWhereTheBoxIsHeardFirst) {
  for (const bool works : {true, false}) {
    BoxedBench bench;
    bench.waived = {Step::kBeam, Step::kRelayWatchdog, Step::kEnable};
    bench.lid_in_stop = true;
    bench.lid_contact_works = works;
    const auto found = bench.run();
    EXPECT_EQ(verdict(found, Step::kLid), works ? "passed" : "failed") << of(found, Step::kLid).measured;
  }
}

TEST(Commission, HasTheBoxResetBeforeEveryStep) {
  BoxedBench bench;
  bench.waived = {Step::kBeam, Step::kLid};
  const auto found = bench.run();
  for (const Step step : {Step::kRelayWatchdog, Step::kEnable})
    EXPECT_EQ(verdict(found, step), "passed") << name_of(step) << ": " << of(found, step).measured;
}

TEST(Commission, FailsForAStopThatNobodyPresses) {
  BoxedBench bench;
  bench.refused = {Deed::kPressStop};
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kEnable), "failed");
  EXPECT_THAT(of(found, Step::kEnable).measured, HasSubstr("asked to press the stop: complete"));
}

TEST(Commission, FailsForAnArmThatGoesOnThoughTheBoxIsOpen) {
  BoxedBench bench;
  bench.press_stop = [&bench](bool pressed) {
    bench.arm.faults.runs_away = true;
    bench.emulator.press_stop(pressed);
  };
  const auto found = bench.run();
  EXPECT_EQ(verdict(found, Step::kEnable), "failed");
  EXPECT_THAT(of(found, Step::kEnable).measured, HasSubstr("ARM MAY BE MOVING"));
}

}  // namespace
}  // namespace tankrig
