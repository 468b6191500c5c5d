// From a fault to the commands on the outputs, for every fault there is; and the way back from it.
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "core/input_error.hpp"
#include "rig/executive/executive.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/plan/operator_plan.hpp"
#include "tests/support/fakes.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::CallLog;
using testing_support::FakeArm;
using testing_support::FakeLaser;

/// A fake arm whose readings can be falsified.
class LyingArm final : public Arm {
 public:
  explicit LyingArm(FakeArm& arm) : arm_(arm) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    auto news = arm_.try_read();
    if (news.ok() && news.value()) {
      news.value()->q += turned;
      news.value()->velocity += moving;
      news.value()->current_a = current_a;
      ticks += ticks_per_reading;
      news.value()->ticks[kElbow] += ticks;
    }
    return news;
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override { return arm_.stop(); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

  JointVector turned = JointVector::Zero(), moving = JointVector::Zero();
  double current_a = 0;
  int ticks_per_reading = 0, ticks = 0;

 private:
  FakeArm& arm_;
};

ScanSettings settings() {
  ScanSettings s;
  s.park << 0, 0.12, 1.2, 0, 0.1;
  s.posture = s.park;
  s.sweep.from = 1.3;
  s.sweep.to = 1.5;
  s.capture.dark_frames = 2;
  s.capture.laser_warm_up = 0.2;
  s.move.settle = 0.1;
  s.control.feed_forward_lead = 0;  // the fake arm has no lag
  s.control.dead_zone.setZero();
  return s;
}

struct FakeStepWatch final : StepWatch {
  const char* says = nullptr;
  void begin(Duration) noexcept override {}
  const char* objection(Stamp) noexcept override { return says; }
  void completed(const OutputRight&) noexcept override {}
  void release() noexcept override {}
};

struct ReactionBench {
  ScanSettings s;
  ScanPlan plan;
  CallLog log;
  FakeArm fake;
  LyingArm arm;
  FakeLaser laser;
  FakeStepWatch watch;
  std::unique_ptr<Executive> sut;
  Stamp now{};
  Duration asleep{};
  CycleRecord last;
  bool heartbeat = true;

  explicit ReactionBench(std::optional<ScanPlan> other = {}, const ScanSettings& settings = tankrig::settings())
      : s(settings),
        plan(other ? std::move(*other) : make_scan_plan(s, s.park)),
        fake(log, s.park),
        arm(fake),
        laser(log),
        sut(std::make_unique<Executive>(plan, s, arm, laser)) {
    sut->set_step_watch(&watch);
    sut->set_interlock(true);
    cycle();
  }

  void cycle() {
    now = now + 5ms;
    fake.advance(now);
    if (heartbeat) sut->heartbeat(now);
    sut->step(now, {asleep, asleep});
    while (sut->try_pop(last)) {
    }
  }
  void cycles(int n) {
    for (int i = 0; i < n; ++i) cycle();
  }
  bool until(const std::function<bool()>& what, int most = 20000) {
    for (int i = 0; i < most && !what(); ++i) cycle();
    return what();
  }
  void go() {
    sut->set_armed(true);
    cycles(2);
    sut->start(now + 1s);
  }
  bool go_sweeping() {
    go();
    const bool lit = until([&] { return laser.on() && plan.segments()[last.segment].phase == Phase::kSweep; });
    cycles(50);
    log.clear();
    return lit && laser.on();
  }
};

/// How each fault is brought about in the middle of a lit sweep, and ended again.
struct Injection {
  std::function<void(ReactionBench&)> begin, end = [](ReactionBench&) {};
  int detected_within = 1;  // cycles, where the fault has a time of its own
};

const std::map<Fault, Injection>& injections() {
  static const auto elbow = [](double value) { return JointVector(value * JointVector::Unit(kElbow)); };
  static const std::map<Fault, Injection> all{
      {Fault::kArmRead,
       {[](ReactionBench& b) { b.fake.fail_read = true; }, [](ReactionBench& b) { b.fake.fail_read = false; }}},
      {Fault::kArmSilent,
       {[](ReactionBench& b) { b.fake.silent = true; }, [](ReactionBench& b) { b.fake.silent = false; }, 52}},
      {Fault::kArmWrite,
       {[](ReactionBench& b) { b.fake.fail_write = true; }, [](ReactionBench& b) { b.fake.fail_write = false; }}},
      {Fault::kLaser,
       {[](ReactionBench& b) { b.laser.fail_state = true; }, [](ReactionBench& b) { b.laser.fail_state = false; }}},
      {Fault::kFollowingError,
       {[](ReactionBench& b) { b.arm.turned = elbow(-0.06); }, [](ReactionBench& b) { b.arm.turned.setZero(); }, 25}},
      {Fault::kHeartbeat,
       {[](ReactionBench& b) { b.heartbeat = false; }, [](ReactionBench& b) { b.heartbeat = true; }, 52}},
      {Fault::kInterlock,
       {[](ReactionBench& b) { b.sut->set_interlock(false); }, [](ReactionBench& b) { b.sut->set_interlock(true); }}},
      {Fault::kOverrun, {[](ReactionBench& b) { b.sut->too_many_overruns(); }}},
      {Fault::kJointLimit,
       {[](ReactionBench& b) { b.arm.turned = -5 * JointVector::Unit(kShoulder); },
        [](ReactionBench& b) { b.arm.turned.setZero(); }, 25}},
      {Fault::kJointVelocity,
       {[](ReactionBench& b) { b.arm.ticks_per_reading = 40; }, [](ReactionBench& b) { b.arm.ticks_per_reading = 0; },
        40}},
      {Fault::kJointCurrent,
       {[](ReactionBench& b) { b.arm.current_a = 90; }, [](ReactionBench& b) { b.arm.current_a = 0; }, 1000}},
      {Fault::kBeamMissing,
       {[](ReactionBench& b) { b.sut->set_beam(BeamVerdict::kMissing); },
        [](ReactionBench& b) { b.sut->set_beam(BeamVerdict::kNone); }}},
      {Fault::kBeamStray,
       {[](ReactionBench& b) { b.sut->set_beam(BeamVerdict::kStray); },
        [](ReactionBench& b) { b.sut->set_beam(BeamVerdict::kNone); }}},
      {Fault::kSuspended, {[](ReactionBench& b) { b.asleep += 8h; }}},
      {Fault::kThread, {[](ReactionBench& b) { b.sut->thread_died(); }}},
      {Fault::kGuardian, {[](ReactionBench& b) { b.watch.says = "guardian: it has taken over"; }}},
  };
  return all;
}

/// Faults that need another plan or other settings; each has a test of its own below. That of the watchdog box needs a
/// box (tests/watchdog).
constexpr Fault kElsewhere[] = {Fault::kNone, Fault::kMaximumOn, Fault::kMovedInHold, Fault::kHoldRefused,
                                Fault::kDisabled};

void expect_safe(ReactionBench& bench, Fault fault) {
  EXPECT_EQ(bench.last.state, ExecutiveState::kFault);
  EXPECT_EQ(bench.last.fault, fault) << to_string(bench.last.fault) << " " << bench.last.error.where;
  EXPECT_FALSE(bench.laser.on());
  EXPECT_LT(bench.log.first("laser off"), bench.log.first("stop")) << "the laser goes off first";
  EXPECT_LT(bench.log.first("stop"), bench.log.count);
}

/// In the very cycle that tells the fault: laser off, then arm stopped.
void expect_reaction(ReactionBench& bench, Fault fault, int detected_within) {
  for (int i = 0; i < detected_within && bench.last.fault == Fault::kNone; ++i) {
    bench.log.clear();
    bench.cycle();
  }
  expect_safe(bench, fault);
}

TEST(FaultReaction, SwitchesTheLaserOffThenStopsTheArmInTheCycleOfEveryFault) {
  for (const auto& [fault, injection] : injections()) {
    SCOPED_TRACE(to_string(fault));
    ReactionBench bench;
    ASSERT_TRUE(bench.go_sweeping());
    injection.begin(bench);
    expect_reaction(bench, fault, injection.detected_within);
    bench.log.clear();
    bench.cycles(200);
    EXPECT_EQ(bench.log.first("laser on"), bench.log.count) << "latched";
    EXPECT_EQ(bench.log.first("velocity"), bench.log.count) << "latched";
  }
}

TEST(FaultReaction, KnowsEveryFaultThereIs) {
  int last = 0;
  while (std::string(to_string(static_cast<Fault>(last))) != "?") ++last;
  for (int f = 0; f < last; ++f) {
    const Fault fault = static_cast<Fault>(f);
    const bool elsewhere = std::find(std::begin(kElsewhere), std::end(kElsewhere), fault) != std::end(kElsewhere);
    EXPECT_TRUE(elsewhere || injections().contains(fault)) << "no test brings about: " << to_string(fault);
  }
}

/// The refused set-point itself, for one.
TEST(FaultReaction, WritesNothingInTheCycleInWhichASetPointIsRefused) {
  const double to_the_limit = settings().limits.angles[kElbow].upper - settings().sweep.from;
  const struct {
    JointViolation::Limit kind;
    double turned, step, gain;
  } cases[] = {{JointViolation::Limit::kSetPointStep, -0.02, 0.1, 6},
               {JointViolation::Limit::kRefusal, to_the_limit + 0.03, 0, 0}};
  for (const auto& c : cases) {
    SCOPED_TRACE(static_cast<int>(c.kind));
    ScanSettings s = settings();
    s.limits.set_point_step = c.step;
    s.limits.refusal_margin = 0.05;
    s.limits.velocity = 1e3;
    s.control.position_gain = c.gain;
    s.control.learning_rate = 0;
    s.control.following_error_limit = 10;
    ReactionBench bench(std::nullopt, s);
    ASSERT_TRUE(bench.go_sweeping());
    bench.arm.turned = c.turned * JointVector::Unit(kElbow);
    bench.cycle();
    expect_safe(bench, c.kind == JointViolation::Limit::kRefusal ? Fault::kJointLimit : Fault::kJointVelocity);
    ASSERT_TRUE(bench.last.violation);
    EXPECT_EQ(bench.last.violation->kind, c.kind);
    EXPECT_EQ(bench.log.first("velocity"), bench.log.count);
    EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
  }
}

TEST(FaultReaction, WritesNoMotionInTheCycleInWhichTheLaserCannotBeSwitchedOn) {
  ReactionBench bench;
  bench.laser.fail = true;
  bench.go();
  ASSERT_TRUE(bench.until([&] {
    if (bench.last.fault == Fault::kNone) bench.log.clear();
    return bench.last.fault != Fault::kNone;
  }));
  expect_safe(bench, Fault::kLaser);
  EXPECT_LT(bench.log.first("laser on"), bench.log.first("laser off"));
  EXPECT_EQ(bench.log.first("velocity"), bench.log.count);
}

TEST(FaultReaction, EndsLightThatLastsTooLong) {
  ScanSettings s = settings();
  s.safety.maximum_on = 2;
  ReactionBench bench(std::nullopt, s);
  bench.go();
  ASSERT_TRUE(bench.until([&] { return bench.laser.on(); }));
  const Stamp lit = bench.now;
  ASSERT_TRUE(bench.until([&] { return !bench.laser.on(); }));
  EXPECT_NEAR(seconds(bench.now - lit), 2, 0.006);
  EXPECT_EQ(bench.last.fault, Fault::kMaximumOn);
  EXPECT_EQ(bench.fake.velocity(), JointVector::Zero());
}

TEST(FaultReaction, LastsWhenTheFaultIsOver) {
  for (const auto& [fault, injection] : injections()) {
    if (fault == Fault::kThread) continue;  // nothing brings a thread back
    SCOPED_TRACE(to_string(fault));
    ReactionBench bench;
    ASSERT_TRUE(bench.go_sweeping());
    injection.begin(bench);
    ASSERT_TRUE(bench.until([&] { return bench.last.state == ExecutiveState::kFault; }, 1100));
    bench.cycles(10);
    bench.sut->set_armed(false);
    injection.end(bench);
    bench.cycles(30);
    const JointVector rested = bench.last.joints.q;
    bench.sut->set_armed(true);
    bench.sut->start(bench.now + 10ms);
    bench.log.clear();
    bench.cycles(200);
    EXPECT_EQ(bench.last.state, ExecutiveState::kFault) << "it came back by itself";
    EXPECT_EQ(bench.last.joints.q, rested);
    EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
  }
}

TEST(FaultReaction, RefusesAPlanThatBeginsElsewhereBeforeAnythingMoves) {
  const ScanSettings s = settings();
  JointVector elsewhere = s.park;
  elsewhere[kElbow] += 0.2;
  ReactionBench bench(make_scan_plan(s, elsewhere));
  bench.go();
  ASSERT_TRUE(bench.until([&] { return bench.last.state == ExecutiveState::kFault; }));
  EXPECT_EQ(bench.last.fault, Fault::kFollowingError);
  EXPECT_EQ(bench.last.joints.q, s.park);
}

TEST(StopFlag, StopsInTheNextCycleWithoutASupervisor) {
  std::atomic<bool> pressed{false};
  ReactionBench bench;
  bench.sut->stop_also_on(pressed);
  ASSERT_TRUE(bench.go_sweeping());
  pressed = true;
  bench.heartbeat = false;
  bench.cycle();
  EXPECT_EQ(bench.last.state, ExecutiveState::kStopped);
  EXPECT_LT(bench.log.first("laser off"), bench.log.first("stop"));
}

ScanPlan lit_hold(const ScanSettings& s, double lit_s) { return make_lit_hold_plan(s, s.park, lit_s); }

TEST(Hold, ShinesWithTheArmAtRestAndMovesNothing) {
  ReactionBench bench(lit_hold(settings(), 3));
  bench.go();
  ASSERT_TRUE(bench.until([&] { return bench.laser.on(); }));
  EXPECT_TRUE(bench.last.holding);
  ASSERT_TRUE(bench.until([&] { return bench.last.state != ExecutiveState::kRunning; }));
  EXPECT_EQ(bench.last.state, ExecutiveState::kDone);
  EXPECT_FALSE(bench.laser.on());
  EXPECT_EQ(bench.last.joints.q, bench.s.park);
}

TEST(Hold, StaysDarkAndSaysSoWhereTheArmWasNotAtRestWhenItWasAskedFor) {
  ReactionBench bench(lit_hold(settings(), 3));
  bench.arm.moving[kElbow] = 0.02;
  bench.go();
  bench.until([&] { return bench.last.state == ExecutiveState::kDone; }, 3000);
  EXPECT_EQ(bench.last.state, ExecutiveState::kFault);
  EXPECT_EQ(bench.last.fault, Fault::kHoldRefused);
  EXPECT_STREQ(bench.last.error.where, "arm: expected at rest");
  EXPECT_EQ(bench.log.first("laser on"), bench.log.count);
}

TEST(Hold, FaultsWhenTheArmMoves) {
  ReactionBench bench(lit_hold(settings(), 3));
  bench.go();
  ASSERT_TRUE(bench.until([&] { return bench.laser.on(); }));
  bench.cycles(20);
  bench.arm.moving[kElbow] = 0.02;
  expect_reaction(bench, Fault::kMovedInHold, 1);
}

TEST(Hold, EndsAtItsLimitWithoutAFault) {
  ScanSettings s = settings();
  s.safety.hold_limit = 1;
  ReactionBench bench(lit_hold(s, 3), s);
  bench.go();
  ASSERT_TRUE(bench.until([&] { return bench.laser.on(); }));
  const Stamp lit = bench.now;
  ASSERT_TRUE(bench.until([&] { return !bench.laser.on(); }));
  EXPECT_NEAR(seconds(bench.now - lit), 1, 0.006);
  EXPECT_EQ(bench.last.state, ExecutiveState::kRunning);
  bench.until([&] { return bench.laser.on() || bench.last.state == ExecutiveState::kDone; });
  EXPECT_FALSE(bench.laser.on());
}

TEST(LightCheck, RefusesAPlanBeyondItsLimitsInOneLine) {
  const auto complaint = [](const ScanPlan& plan, const SafetySettings& s) -> std::string {
    try {
      check_light(plan, s);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const ScanSettings s = settings();
  const ScanPlan scan = make_scan_plan(s, s.park), hold = lit_hold(s, 3);
  EXPECT_EQ(complaint(scan, s.safety), "");
  EXPECT_EQ(complaint(hold, s.safety), "");
  SafetySettings strict = s.safety;
  strict.maximum_on = 2;
  EXPECT_EQ(complaint(scan, strict).rfind("scan: safety: maximum_on_s: found 2, expected at least the ", 0), 0u);
  strict.maximum_on = 100;
  strict.hold_limit = 2;
  EXPECT_EQ(complaint(hold, strict).rfind("scan: safety: hold_limit_s: found 2, expected at least the ", 0), 0u);
}

TEST(GuardedOutputs, AllowsNothingTwiceAndNothingWithoutAStep) {
  CallLog log;
  FakeArm arm(log, JointVector::Zero());
  FakeLaser laser(log);
  const JointVector v = JointVector::Constant(0.1);
  {
    GuardedOutputs sut(arm, laser, {});
    EXPECT_TRUE(sut.switch_laser().ok());
    EXPECT_FALSE(sut.move(v).ok());
    EXPECT_EQ(log.first("laser on"), log.count);
    EXPECT_EQ(log.first("velocity"), log.count);
    EXPECT_TRUE(sut.move(JointVector::Zero()).ok()) << "rest is always allowed";

    InterlockInputs in;
    in.interlock_closed = in.heartbeat_fresh = in.sweeping = in.laser_request = true;
    sut.step(in);
    in.arm = true;
    sut.step(in);
    in.now = in.now + 1s;
    sut.step(in);
    EXPECT_TRUE(sut.switch_laser().ok());
    EXPECT_TRUE(laser.on());
    EXPECT_TRUE(sut.move(v).ok());
    EXPECT_FALSE(sut.move(v).ok()) << "allowed once";
    EXPECT_EQ(arm.velocity(), JointVector::Zero()) << "a refusal stops";
    EXPECT_TRUE(sut.switch_laser().ok());
    EXPECT_FALSE(laser.on()) << "no new step, no light";
    sut.step(in);
    EXPECT_TRUE(sut.switch_laser().ok());
    ASSERT_TRUE(laser.on());
    log.clear();
  }
  EXPECT_FALSE(laser.on());
  EXPECT_EQ(log.first("laser off"), 0u);
  EXPECT_EQ(log.first("stop"), 1u);
}

}  // namespace
}  // namespace tankrig
