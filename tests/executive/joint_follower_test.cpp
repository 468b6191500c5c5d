// How true the sweep is: the simulated arm's real motion, with all that is known to be wrong with the real one.
#include "rig/executive/joint_follower.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "drivers/arm/backlash_arm.hpp"
#include "rig/plan/operator_plan.hpp"
#include "rig/plan/plan_csv.hpp"
#include "session/recording/event_kinds.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig::testing_support {
namespace {

using namespace std::chrono_literals;

/// Asks the plant, whenever a joint state comes, where the elbow was and how far that is from the plan.
class TruthSink final : public ScanSink {
 public:
  struct Sample {
    double t, q;  // plan time; true elbow angle
  };
  std::vector<Sample> truth;
  Stamp zero{};
  sim::MockArm* arm = nullptr;

  void joints(const JointState& state) override {
    if (zero.ns != 0) truth.push_back({seconds(state.stamp - zero), arm->truth_at(state.stamp)[kElbow]});
  }
  void frame(const FrameRecord&, const cv::Mat&) override {}
  void event(Stamp when, std::string_view kind, const std::string&) override {
    if (kind == event_kind::kPlan) zero = when;
  }
};

struct Trueness {
  double velocity = 0;  ///< largest |v / v planned - 1| of the mean over any second of a recorded part
  double position = 0;  ///< largest distance from the plan there [rad]
  int windows = 0;
};

Trueness trueness(const TruthSink& sink, const ScanPlan& plan) {
  Trueness worst;
  for (const Segment& s : plan.segments()) {
    if (s.phase != Phase::kSweep) continue;
    std::size_t begin = 0;
    for (std::size_t end = 0; end < sink.truth.size(); ++end) {
      const auto& last = sink.truth[end];
      if (last.t < s.record_begin || last.t > s.record_end) continue;
      worst.position = std::max(worst.position, std::abs(last.q - plan.at(last.t).q[kElbow]));
      while (last.t - sink.truth[begin].t > 1 + 1e-6) ++begin;
      const auto& first = sink.truth[begin];
      if (first.t < s.record_begin || last.t - first.t < 1 - 1e-6) continue;
      const double planned = plan.at(last.t).q[kElbow] - plan.at(first.t).q[kElbow];
      worst.velocity = std::max(worst.velocity, std::abs((last.q - first.q) / planned - 1));
      ++worst.windows;
    }
  }
  return worst;
}

using Play = std::array<double, kJoints>;

/// A scan there and back of an arm with habits, whose play the rig file has as `known_play`.
Trueness sweep(double velocity, const sim::MockArmParameters& arm, const Play& known_play) {
  MockRig rig;
  rig.s.sweep.velocity = velocity;
  rig.s.sweep.from = 1.0;
  rig.s.sweep.to = 2.04;  // room for the ramps and the lead-in
  rig.s.sweep.passes = 2;
  rig.s.control.following_error_limit = 0.03;
  rig.mock.arm = arm;
  rig.power_on();
  BacklashArm links(*rig.arm, rig.model, known_play);
  const ScanPlan plan = make_scan_plan(rig.s, rig.s.park);
  TruthSink sink;
  sink.arm = rig.arm.get();
  ScanJob job{plan, rig.s, rig.clock, links, *rig.laser, {}, sink, rig.stop, rig.interlock_closed, {}};
  const ScanResult result = run_scan(job);
  EXPECT_EQ(result.status, "complete");
  return trueness(sink, plan);
}

/// What the documents say of the real arm (dead zone, encoders, the wire's whole ticks/s and its missing 0x0A), and
/// plausible sizes of what they do not say: 30 ticks of backlash, speeds a few percent off, a late answer.
sim::MockArmParameters worn_arm() {
  sim::MockArmParameters arm;
  arm.backlash_ticks = {30, 30, 30, 2, 2};
  arm.stiction_ticks_per_s = {150, 250, 100, 40, 80};
  arm.speed_gain = {0.97, 1.03, 0.96, 1.02, 0.98};
  arm.time_constant = 0.05;
  arm.feedback_latency = 15ms;
  return arm;
}

TEST(JointFollower, KeepsTheTrueVelocityWithinOnePercentOverAnySecondOfTheSweep) {
  struct Case {
    const char* name;
    sim::MockArmParameters arm;
  };
  sim::MockArmParameters fast = worn_arm(), slow_wire = worn_arm();
  fast.speed_gain[kElbow] = 1.05;
  fast.backlash_ticks[kElbow] = 40;
  slow_wire.exchange_period = 20ms;
  for (const Case& c : {Case{"as documented", {}},
                        {"worn, 4 % slow", worn_arm()},
                        {"worn, 5 % fast", fast},
                        {"worn, 50 exchanges/s", slow_wire}})
    for (const double velocity : {0.08, 0.1, 0.15}) {
      const Trueness worst = sweep(velocity, c.arm, c.arm.backlash_ticks);
      std::printf("%-22s %.2f rad/s: velocity %.2f %%, position %.2f mrad (%d windows)\n", c.name, velocity,
                  100 * worst.velocity, 1e3 * worst.position, worst.windows);
      EXPECT_LE(worst.velocity, 0.01) << c.name << " at " << velocity;
      EXPECT_GT(worst.windows, 500) << c.name << " at " << velocity;
    }
}

/// The elbow moves `gain` times as fast as it is told to, at once; its state is `late` old when it comes.
struct Loop {
  ScanSettings s;
  ScanPlan plan;
  JointFollower sut{s};
  JointState state;
  double worst = 0;  // trail over the second half of the motion

  Loop(double gain, Duration late) : s(settings()), plan(make_move_plan(s, from(), to(), "move")) {
    JointVector q = from();
    const double half = 0.5 * plan.duration();
    for (double t = 0; t < plan.duration(); t += 0.01) {
      state.q = q;
      state.stamp = Stamp{} + from_seconds(1 + t);
      q += 0.01 * gain * sut.step(plan, t + seconds(late), late, state);
      if (t > half && plan.at(t).velocity[kElbow] == s.move.velocity)
        worst = std::max(worst, std::abs(plan.at(t).q[kElbow] - state.q[kElbow]));
    }
  }
  static ScanSettings settings() {
    ScanSettings s;
    s.control.feed_forward_lead = 0;
    s.move.settle = 0;
    return s;
  }
  static JointVector from() { return (JointVector() << 0, 0.3, 0.5, 0, 0.1).finished(); }
  static JointVector to() { return (JointVector() << 0, 0.3, 1.7, 0, 0.1).finished(); }
};

TEST(JointFollower, LearnsHowMuchSlowerOrFasterThanAskedAnActuatorIs) {
  for (const double gain : {0.95, 1.0, 1.06}) {
    const Loop loop(gain, Duration{});
    EXPECT_NEAR(loop.sut.correction()[kElbow], 1 / gain - 1, 0.003) << gain;
    EXPECT_EQ(loop.sut.correction()[kShoulder], 0);
    EXPECT_LT(loop.worst, 2e-4) << "a proportional controller alone trails by " << std::abs(1 - gain) * 0.1 / 6;
  }
}

TEST(JointFollower, ComparesWithThePlanOfTheInstantAtWhichAJointWasRead) {
  EXPECT_LT(Loop(1.0, 30ms).worst, 1e-4);
  const ScanSettings s = Loop::settings();
  const ScanPlan plan = make_move_plan(s, Loop::from(), Loop::to(), "move");
  JointState state;
  state.age[kElbow] = 200ms;
  const JointVector planned = planned_when_measured(plan, 5, 1s, state);
  EXPECT_DOUBLE_EQ(planned[kElbow], plan.at(3.8).q[kElbow]);
  EXPECT_DOUBLE_EQ(planned[kShoulder], plan.at(4).q[kShoulder]);
}

TEST(JointFollower, NeverDrivesAJointAgainstItsWayNorSlowerThanItsDeadZone) {
  const ScanSettings s = Loop::settings();
  const ScanPlan plan = make_move_plan(s, Loop::from(), Loop::to(), "move");
  for (double t = 0; t < plan.duration(); t += 0.01)
    for (const double error : {-0.03, -0.01, 0.0, 0.01, 0.03}) {
      JointFollower sut(s);
      JointState state;
      state.q = plan.at(t).q;
      state.q[kElbow] -= error;
      const double speed = sut.step(plan, t, Duration{}, state)[kElbow];
      EXPECT_TRUE(speed == 0 || speed >= s.control.dead_zone[kElbow]) << speed;
    }
}

}  // namespace
}  // namespace tankrig::testing_support
