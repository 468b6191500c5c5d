// How a scan ends when the devices do not do what they are told.
#include <gtest/gtest.h>

#include <utility>

#include "core/input_error.hpp"
#include "tests/support/mock_rig.hpp"
#include "tests/support/slow_camera.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::MockRig;
using testing_support::SlowCamera;

/// Does `what` once, in the middle of the sweep.
void in_the_sweep(MockRig& rig, std::function<void()> what) {
  rig.progress = [&rig, what, done = false](const ScanProgress& p) mutable {
    if (!done && p.phase == Phase::kSweep && p.fraction > 0.5) {
      done = true;
      what();
    }
  };
}

bool arm_rests(MockRig& rig) {
  return rig.arm->true_velocity_at(rig.clock.now()).cwiseAbs().maxCoeff() < rig.s.safety.rest_velocity;
}

TEST(ScanSafety, ConfirmsLaserDarkAndArmAtRestAtTheEndOfAPlan) {
  MockRig rig;
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.complete());
  EXPECT_TRUE(result.left.laser_dark);
  EXPECT_TRUE(result.left.arm_at_rest);
  EXPECT_TRUE(rig.sink.told("summary", "laser off, arm at rest"));
}

TEST(ScanSafety, SaysThatTheLaserMayBeOnWhenItsRelayHasWelded) {
  MockRig rig;
  in_the_sweep(rig, [&] {
    rig.laser->faults.stuck_on = true;
    rig.stop = true;
  });
  const ScanResult result = rig.run();
  ASSERT_TRUE(rig.laser->state().value().powered);
  EXPECT_FALSE(result.left.laser_dark);
  EXPECT_TRUE(result.left.arm_at_rest);
  EXPECT_EQ(to_string(result.left), "LASER MAY BE ON: cut its supply; arm at rest");
  EXPECT_TRUE(rig.sink.told("fault", "laser: on though not commanded"));
  EXPECT_TRUE(rig.sink.told("fault", "LASER MAY BE ON"));
}

TEST(ScanSafety, NoticesAWeldedRelayInTheDarkBlockAfterTheSweep) {
  MockRig rig;
  in_the_sweep(rig, [&] { rig.laser->faults.stuck_on = true; });
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("laser: on though not commanded"), std::string::npos) << result.status;
  EXPECT_FALSE(result.left.laser_dark);
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkAfter).size(), 0u);
}

TEST(ScanSafety, RetriesALaserThatRefusesToGoOffAndTellsItOnce) {
  MockRig rig;
  int asked = 0;
  rig.interlock_closed = [&] {  // asked in every round: the laser recovers 50 cycles after the stop
    if (rig.stop && ++asked == 50) rig.laser->faults.set_fails = false;
    return true;
  };
  in_the_sweep(rig, [&] { rig.laser->faults.set_fails = rig.stop = true; });
  const ScanResult result = rig.run();
  EXPECT_GE(asked, 50);
  EXPECT_TRUE(result.left.safe());
  EXPECT_FALSE(rig.laser->state().value().powered);
  int told = 0;
  for (const auto& e : rig.sink.events)
    told += e.kind == "fault" && e.text.starts_with("laser not switched off: laser: switch");
  EXPECT_EQ(told, 1);
}

TEST(ScanSafety, GivesUpALaserThatNeverGoesOffAfterItsTimeAndSaysSo) {
  MockRig rig;
  Stamp stopped;
  in_the_sweep(rig, [&] {
    rig.laser->faults.set_fails = rig.stop = true;
    stopped = rig.clock.now();
  });
  const ScanResult result = rig.run();
  EXPECT_FALSE(result.left.laser_dark);
  EXPECT_NEAR(seconds(rig.clock.now() - stopped), rig.s.safety.rest_timeout, 0.05);
}

TEST(ScanSafety, WaitsForTheArmThatRefusesToStopUntilItsWatchdogHasStoppedIt) {
  MockRig rig;
  in_the_sweep(rig, [&] { rig.arm->faults.stop_fails = rig.stop = true; });
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.left.safe());
  EXPECT_TRUE(arm_rests(rig));
  EXPECT_TRUE(rig.sink.told("fault", "arm not stopped: arm: stop"));
}

TEST(ScanSafety, SaysThatTheArmMayBeMovingWhenItRunsAway) {
  MockRig rig;
  rig.s.safety.rest_timeout = 1;  // before the arm comes to its limit
  in_the_sweep(rig, [&] { rig.arm->faults.runs_away = rig.stop = true; });
  const ScanResult result = rig.run();
  ASSERT_FALSE(arm_rests(rig));
  EXPECT_TRUE(result.left.laser_dark);
  EXPECT_FALSE(result.left.arm_at_rest);
  EXPECT_EQ(to_string(result.left), "laser off; ARM MAY BE MOVING: cut its power");
}

TEST(ScanSafety, IsNotCompleteWhereTheArmDoesNotRestAfterThePlan) {
  MockRig rig;
  rig.s.control.following_error_limit = 10;
  rig.progress = [&](const ScanProgress& p) {
    if (p.segment == "move to park") rig.arm->faults.runs_away = true;
  };
  const ScanResult result = rig.run();
  EXPECT_FALSE(result.complete());
  EXPECT_FALSE(result.left.arm_at_rest);
}

TEST(ScanSafety, ConfirmsTheEndOnTheWayOutByAnExceptionToo) {
  MockRig safe, welded;
  safe.sink.throw_at = welded.sink.throw_at = 50;
  EXPECT_THROW(safe.run(), std::runtime_error);
  EXPECT_TRUE(safe.left.safe());
  EXPECT_TRUE(arm_rests(safe));
  welded.sink.on_frame = [&](const FrameRecord& f) {
    if (f.phase == Phase::kSweep) welded.laser->faults.stuck_on = true;
  };
  EXPECT_THROW(welded.run(), std::runtime_error);
  EXPECT_FALSE(welded.left.laser_dark);
  EXPECT_TRUE(welded.left.arm_at_rest);
  EXPECT_TRUE(welded.sink.told("fault", "disk full; LASER MAY BE ON"));
}

/// Falls silent at some moment, and its driver finds nothing wrong; or takes its time for every call.
class MuteCamera final : public Camera {
 public:
  MuteCamera(Camera& camera, Clock& clock) : camera_(camera), clock_(clock) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override {
    clock_.sleep_until(clock_.now() + std::exchange(starting, Duration{0}));
    return camera_.start();
  }
  Result<std::optional<Frame>> try_grab() override {
    if (slow.count() > 0) clock_.sleep_until(clock_.now() + slow);
    if (broken) return Error{ErrorCode::kInternal, 0, clock_.now(), "camera: its thread is dead or stuck"};
    auto news = camera_.try_grab();
    if (mute) return std::optional<Frame>{};
    return news;
  }
  void stop() noexcept override { camera_.stop(); }
  CameraCounters counters() const override { return camera_.counters(); }
  Status trigger() override {
    if (breaks_triggered) throw std::runtime_error("driver");
    return camera_.trigger();
  }

  bool mute = false, broken = false, breaks_triggered = false;
  Duration slow{0};
  Duration starting{0};  ///< the first time

 private:
  Camera& camera_;
  Clock& clock_;
};

/// A scan with one camera, to which something happens early in the sweep.
struct MuteRig : MockRig {
  std::unique_ptr<MuteCamera> camera;
  TriggerSettings trigger;
  bool mute_from_start = false;
  Duration starting{0};
  Stamp happened;

  ScanResult run(const std::function<void(MuteCamera&)>& happens) {
    mock.camera.triggered = trigger.mode != TriggerMode::kFree;
    power_on();
    camera = std::make_unique<MuteCamera>(*cameras[0], clock);
    camera->mute = mute_from_start;
    camera->starting = starting;
    progress = [this, &happens](const ScanProgress& p) {
      if (happened.ns != 0 || p.phase != Phase::kSweep || sink.of("mono", Phase::kSweep).size() < 5) return;
      happened = clock.now();
      happens(*camera);
    };
    plan = std::make_unique<ScanPlan>(make_scan_plan(s, read_posture(*arm, clock, 1s)));
    ScanJob job{
        *plan,   s, clock, *arm, *laser, {{camera.get(), RecordWhen::kAll, {}, trigger}}, sink, stop, interlock_closed,
        progress};
    return run_scan(job);
  }
  double ended_after() const {
    for (const auto& e : sink.events)
      if (e.kind == "stop" || e.kind == "fault") return seconds(e.when - happened);
    return -1;
  }
};

TEST(ScanSafety, EndsWhereACameraFallsSilentAndNamesIt) {
  for (const double timeout : {0.4, 1.0}) {
    MuteRig rig;
    rig.s.safety.camera_timeout = timeout;
    const ScanResult result = rig.run([](MuteCamera& c) { c.mute = true; });
    char expected[64];
    std::snprintf(expected, sizeof expected, "stopped: camera mono: no frame for %.1f s", timeout);
    EXPECT_EQ(result.status, expected);
    EXPECT_GT(rig.ended_after(), timeout - 0.05);
    EXPECT_LT(rig.ended_after(), timeout + 0.05);
    EXPECT_TRUE(result.left.safe());
  }
}

TEST(ScanSafety, EndsWhereACameraGivesNoFrameToSetTheFrameGridByAndNamesIt) {
  MuteRig rig;
  rig.mute_from_start = true;
  const ScanResult result = rig.run([](MuteCamera&) {});
  EXPECT_EQ(result.status, "stopped: camera mono: no frame for 3.0 s");
  EXPECT_TRUE(result.left.safe());
}

/// A machine that is slow to lock its memory and to start a camera is not one whose camera gives no frames.
TEST(ScanSafety, CountsTheTimeToTheFirstFrameFromTheCamerasStart) {
  MuteRig rig;
  rig.starting = 4s;
  EXPECT_EQ(rig.run([](MuteCamera&) {}).status, "complete");
}

TEST(ScanSafety, EndsWhereATriggeredCameraAnswersNoTriggerAndNamesIt) {
  MuteRig rig;
  rig.trigger = {TriggerMode::kPosition, 4e-3, std::nullopt};
  const ScanResult result = rig.run([](MuteCamera& c) { c.mute = true; });
  EXPECT_EQ(result.status, "stopped: camera mono: no frame for 1.0 s");
  EXPECT_LT(rig.ended_after(), 1.1);
}

TEST(ScanSafety, NamesTheCameraThatHoldsTheSupervisorUp) {
  MuteRig rig;
  const ScanResult result = rig.run([](MuteCamera& c) { c.slow = 400ms; });
  EXPECT_NE(result.status.find("heartbeat late"), std::string::npos) << result.status;
  EXPECT_NE(result.status.find("camera mono: held the supervisor up for 400 ms"), std::string::npos) << result.status;
  EXPECT_TRUE(result.left.safe());
}

TEST(ScanSafety, GoesOnWhereCamerasTogetherTakeLongToStartOrToStopAndNoneOfThemAlone) {
  MockRig rig;
  ASSERT_EQ(rig.s.control.heartbeat_timeout, 0.25);
  rig.power_on();
  rig.plan = std::make_unique<ScanPlan>(make_scan_plan(rig.s, read_posture(*rig.arm, rig.clock, 1s)));
  const auto black = [](const std::string&, const sim::Exposure&) { return cv::Mat(2, 2, CV_8UC1, cv::Scalar(0)); };
  sim::MockCamera eye({"right", 2, 2, 1, 25}, rig.mock.camera, rig.clock, *rig.arm, *rig.laser, black);
  SlowCamera left(*rig.cameras[1], rig.clock, 150ms, 150ms), right(eye, rig.clock, 150ms, 150ms);
  ScanJob job{*rig.plan,
              rig.s,
              rig.clock,
              *rig.arm,
              *rig.laser,
              {{rig.cameras[0].get(), RecordWhen::kAll}, {&left, RecordWhen::kDark}, {&right, RecordWhen::kDark}},
              rig.sink,
              rig.stop,
              rig.interlock_closed,
              rig.progress};
  EXPECT_EQ(run_scan(job).status, "complete");
}

TEST(ScanSafety, BlamesNoCameraForWhatItDidInAnEarlierRound) {
  MockRig rig;
  rig.s.control.heartbeat_timeout = 0.35;
  bool held_up = false;
  rig.sink.on_frame = [&](const FrameRecord& frame) {
    if (frame.phase == Phase::kSweep && !std::exchange(held_up, true)) rig.clock.sleep_until(rig.clock.now() + 500ms);
  };
  rig.power_on();
  SlowCamera mono(*rig.cameras[0], rig.clock, 400ms);  // before the plan begins: nothing hangs on it
  rig.plan = std::make_unique<ScanPlan>(make_scan_plan(rig.s, read_posture(*rig.arm, rig.clock, 1s)));
  ScanJob job{*rig.plan,   rig.s,      rig.clock,
              *rig.arm,    *rig.laser, {{&mono, RecordWhen::kAll}},
              rig.sink,    rig.stop,   rig.interlock_closed,
              rig.progress};
  const std::string status = run_scan(job).status;
  EXPECT_NE(status.find("heartbeat late"), std::string::npos) << status;
  EXPECT_EQ(status.find("camera mono"), std::string::npos) << status;
}

/// Answers, but no longer knows its angles.
class UnreferencedArm final : public Arm {
 public:
  explicit UnreferencedArm(Arm& arm) : arm_(arm) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    auto news = arm_.try_read();
    if (lost && news.ok() && news.value()) {
      JointState state = *news.value();
      state.q.setConstant(std::nan(""));
      state.velocity.setConstant(std::nan(""));
      return std::optional(state);
    }
    return news;
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override { return arm_.stop(); }
  void last_resort() noexcept override { arm_.last_resort(); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

  bool lost = false;

 private:
  Arm& arm_;
};

TEST(ScanSafety, RecordsNoJointsOfAnArmThatLostItsReference) {
  MockRig rig;
  rig.power_on();
  UnreferencedArm arm(*rig.arm);
  in_the_sweep(rig, [&] { arm.lost = true; });
  rig.plan = std::make_unique<ScanPlan>(make_scan_plan(rig.s, read_posture(*rig.arm, rig.clock, 1s)));
  ScanJob job{*rig.plan,   rig.s,      rig.clock,
              arm,         *rig.laser, {{rig.cameras[0].get(), RecordWhen::kAll}},
              rig.sink,    rig.stop,   rig.interlock_closed,
              rig.progress};
  const ScanResult result = run_scan(job);
  EXPECT_FALSE(result.complete());
  ASSERT_TRUE(arm.lost);
  EXPECT_GT(result.counts.at("joints.without_angles"), 0u);
  for (const JointState& state : rig.sink.states) EXPECT_TRUE(state.q.allFinite() && state.velocity.allFinite());
  for (const FrameRecord& frame : rig.sink.frames) EXPECT_TRUE(frame.q->allFinite());
}

TEST(ScanSafety, FaultsWhereACamerasThreadDiesAndNamesIt) {
  MuteRig dead, triggered;
  const ScanResult result = dead.run([](MuteCamera& c) { c.broken = true; });
  EXPECT_NE(result.status.find("thread died"), std::string::npos) << result.status;
  EXPECT_NE(result.status.find("camera mono: camera: its thread is dead or stuck"), std::string::npos) << result.status;
  EXPECT_LT(dead.ended_after(), 0.02);

  triggered.trigger = {TriggerMode::kPosition, 4e-3, std::nullopt};
  const ScanResult other = triggered.run([](MuteCamera& c) { c.breaks_triggered = true; });
  EXPECT_NE(other.status.find("thread died"), std::string::npos) << other.status;
  EXPECT_NE(other.status.find("camera mono: its trigger thread is dead or stuck"), std::string::npos) << other.status;
  EXPECT_LT(triggered.ended_after(), 0.1);
  EXPECT_TRUE(other.left.safe());
}

TEST(ScanSafety, StopsWhereTheLaserStaysDark) {
  MockRig rig;
  rig.power_on();
  rig.laser->faults.dead = true;
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("laser: dark after its warm-up"), std::string::npos) << result.status;
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkAfter).size(), 0u);
  EXPECT_TRUE(result.left.safe());
}

TEST(ScanSafety, RefusesToScanWithTheInterlockOpenOrUnknown) {
  for (const bool known : {true, false}) {
    MockRig rig;
    if (known)
      rig.interlock_closed = [] { return false; };
    else
      rig.interlock_closed = nullptr;
    try {
      rig.run();
      ADD_FAILURE() << "scanned";
    } catch (const InputError& e) {
      EXPECT_STREQ(e.what(), "scan: laser interlock: found open, expected closed");
    }
    EXPECT_TRUE(rig.sink.states.empty());
  }
}

TEST(ScanSafety, DropsBeamAndStopsWhenTheInterlockOpensInTheSweep) {
  MockRig rig;
  bool closed = true;
  rig.interlock_closed = [&] { return closed; };
  in_the_sweep(rig, [&] { closed = false; });
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("interlock open"), std::string::npos) << result.status;
  EXPECT_TRUE(result.left.safe());
  EXPECT_FALSE(rig.laser->state().value().powered);
}

TEST(ScanSafety, DoesNotScanWithoutBeamWhenTheInterlockOpensBeforeItIsArmed) {
  MockRig rig;
  int asked = 0;
  rig.interlock_closed = [&] { return ++asked == 1; };
  const ScanResult result = rig.run();
  EXPECT_EQ(result.status, "stopped: laser interlock: found open, expected closed");
  EXPECT_TRUE(rig.sink.frames.empty());
}

TEST(ScanSafety, TakesARoundThatIsHeldUpForALateHeartbeat) {
  for (const Duration held : {200ms, 300ms}) {
    MockRig rig;
    rig.mock.arm.watchdog = 1s;
    rig.s.control.feedback_timeout = 1;
    bool once = true;
    rig.sink.on_frame = [&](const FrameRecord& f) {
      if (f.phase == Phase::kSweep && f.index > 30 && std::exchange(once, false))
        rig.clock.sleep_until(rig.clock.now() + held);
    };
    const ScanResult result = rig.run();
    if (held < 250ms)
      EXPECT_TRUE(result.complete()) << result.status;
    else
      EXPECT_NE(result.status.find("heartbeat late"), std::string::npos) << result.status;
    EXPECT_TRUE(result.left.safe());
  }
}

TEST(ScanSafety, WritesItsWorstFollowingErrorAndSyncResidualIntoTheSession) {
  MockRig rig;
  const ScanResult result = rig.run();
  char line[80];
  std::snprintf(line, sizeof line, "largest following error %.5f rad", result.max_following_error);
  EXPECT_TRUE(rig.sink.told("summary", line));
  std::snprintf(line, sizeof line, "largest sync residual %.3f ms", 1e3 * seconds(result.worst_residual));
  EXPECT_TRUE(rig.sink.told("summary", line));
  EXPECT_GT(result.max_following_error, 0);
}

}  // namespace
}  // namespace tankrig
