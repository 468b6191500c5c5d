// A cycle that hangs inside a device's driver, on the real clock: dark, stopped, told and left within bounds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include "rig/executive/cycle.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// Holds up whoever passes it, from when it is closed.
struct Gate {
  std::atomic<bool> closed{false};
  void pass() const noexcept {
    while (closed) std::this_thread::sleep_for(1ms);
  }
};

/// In which order the devices were made safe while the cycle hung, and whether light or motion was commanded later.
struct Order {
  std::atomic<int> calls{0}, laser_off{0}, arm_stop{0}, forgotten{0};
  void note(std::atomic<int>& first) noexcept {
    int none = 0;
    first.compare_exchange_strong(none, ++calls);
  }
};

/// Another arm, whose readings pass a gate.
class GatedArm final : public Arm {
 public:
  GatedArm(Arm& arm, const Gate& gate, const Gate& other, Order& order)
      : arm_(arm), gate_(gate), other_(other), order_(order) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    gate_.pass();
    return arm_.try_read();
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    if (order_.arm_stop > 0 && !v.isZero()) ++order_.forgotten;
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override {
    if (gate_.closed || other_.closed) order_.note(order_.arm_stop);
    ++stops;
    return arm_.stop();
  }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

  std::atomic<int> stops{0};

 private:
  Arm& arm_;
  const Gate &gate_, &other_;
  Order& order_;
};

/// Another laser, whose state passes a gate.
class GatedLaser final : public Laser {
 public:
  GatedLaser(Laser& laser, const Gate& gate, const Gate& other, Order& order)
      : laser_(laser), gate_(gate), other_(other), order_(order) {}
  Status set(bool on) noexcept override {
    if (!on && (gate_.closed || other_.closed)) order_.note(order_.laser_off);
    if (on && order_.laser_off > 0) ++order_.forgotten;
    return Laser::set(laser_, on);
  }
  Result<LaserState> state() noexcept override {
    gate_.pass();
    return laser_.state();
  }
  Duration warm_up() const noexcept override { return laser_.warm_up(); }

 private:
  Laser& laser_;
  const Gate &gate_, &other_;
  Order& order_;
};

enum class Inside { kArm, kLaser };

/// A scan whose cycle hangs in the middle of its lit sweep.
struct HungRig : testing_support::MockRigUnder<MonotonicClock> {
  Gate in_arm, in_laser;
  Order order;
  std::optional<GatedArm> gated_arm;
  std::optional<GatedLaser> gated_laser;
  bool dark_while_hung = false;
  std::vector<std::string> to_cut;

  HungRig() {
    s.park << 0, 0.12, 1.3, 0, 0.1;
    s.sweep.from = 1.35;
    s.sweep.to = 1.65;
    s.capture.dark_frames = 2;
    s.move.settle = 0.1;
    s.capture.laser_warm_up = 0.2;
    s.control.heartbeat_timeout = 1.5;
    s.control.feedback_timeout = 30;
    s.control.following_error_limit = 0.5;
    s.safety.rest_timeout = 1;
    s.real_time.required = false;
    s.real_time.overruns = 0;
    mock.laser_warm_up = 200ms;
    mock.arm.watchdog = 20s;  // so that what stops it is what is looked at
    power_on();
    gated_arm.emplace(*arm, in_arm, in_laser, order);
    gated_laser.emplace(*laser, in_laser, in_arm, order);
  }

  Gate& gate(Inside inside) { return inside == Inside::kArm ? in_arm : in_laser; }

  ScanResult hang(Inside inside, const std::function<void()>& when_told = {}) {
    sink.on_frame = [this, inside](const FrameRecord& f) {
      if (f.phase == Phase::kSweep && f.index > 6) gate(inside).closed = true;
    };
    sink.on_event = [this, inside, when_told](std::string_view kind, const std::string& text) {
      if (kind != "fault" || !text.starts_with("cycle: hangs")) return;
      EXPECT_EQ(to_cut.size(), 1u) << "nothing of it can be confirmed";
      dark_while_hung = gate(inside).closed && !laser->state().value().powered;
      if (when_told) when_told();
    };
    plan = std::make_unique<ScanPlan>(make_scan_plan(s, read_posture(*arm, clock, 5s)));
    ScanJob job{*plan,
                s,
                clock,
                *gated_arm,
                *gated_laser,
                {{cameras[0].get(), RecordWhen::kAll}},
                sink,
                stop,
                interlock_closed,
                {},
                [this](const std::string& what) { to_cut.push_back(what); }};
    return run_scan(job);
  }

  bool arm_rests() { return arm->true_velocity_at(clock.now()).cwiseAbs().maxCoeff() < s.safety.rest_velocity; }

  void expect_safe_past_it(const ScanResult& result) {
    EXPECT_THAT(result.status, HasSubstr("stopped: cycle: hangs: no step for "));
    EXPECT_TRUE(sink.told("fault", "laser switched off and arm stopped past it"));
    EXPECT_TRUE(dark_while_hung);
    EXPECT_GT(order.laser_off, 0);
    EXPECT_LT(order.laser_off, order.arm_stop) << "the laser goes off first";
    EXPECT_EQ(order.forgotten, 0) << "the step that hung went on as if nothing had been";
    EXPECT_FALSE(laser->state().value().powered);
    EXPECT_TRUE(arm_rests());
  }
};

class HungCycle : public testing::TestWithParam<Inside> {};

TEST_P(HungCycle, ThatComesBackEndsItsScanConfirmedDarkAndAtRest) {
  HungRig rig;
  const ScanResult result = rig.hang(GetParam(), [&] { rig.gate(GetParam()).closed = false; });
  rig.expect_safe_past_it(result);
  EXPECT_TRUE(result.left.safe());
  EXPECT_EQ(rig.to_cut.back(), "") << "it is over";
  EXPECT_TRUE(result.times) << "it was not left behind";
}

/// What a cycle was left behind in lives as long as the program.
HungRig& rig_for_good() {
  static std::vector<HungRig*> rigs;
  return *rigs.emplace_back(new HungRig);
}

TEST_P(HungCycle, ThatNeverComesBackIsLeftBehindAndNothingIsSaidToBeConfirmed) {
  HungRig& rig = rig_for_good();
  int pictures = 0;  // when it was told
  const ScanResult result = rig.hang(GetParam(), [&] { pictures = rig.rendered["mono"]; });
  rig.expect_safe_past_it(result);
  EXPECT_TRUE(Cycle::any_left_behind());
  EXPECT_EQ(rig.to_cut.back(), to_string(result.left)) << "and is never taken back";
  EXPECT_EQ(to_string(result.left), "LASER MAY BE ON: cut its supply; ARM MAY BE MOVING: cut its power");
  EXPECT_TRUE(rig.sink.told("fault", "LASER MAY BE ON"));
  EXPECT_GE(result.counts.at("mono.joints_after"), 1u) << "frames that waited are not counted";
  EXPECT_LT(rig.rendered["mono"] - pictures, 10) << "frames go on piling up, one in 40 ms";

  const int before = rig.gated_arm->stops;
  rig.gate(GetParam()).closed = false;
  const Stamp deadline = rig.clock.now() + 30s;
  while (rig.gated_arm->stops < before + 5 && rig.clock.now() < deadline) std::this_thread::yield();
  EXPECT_GE(rig.gated_arm->stops, before + 5) << "does not go on making safe when it comes back after all";
  EXPECT_FALSE(rig.laser->state().value().powered);
}

TEST_P(HungCycle, EndsItsScanAlsoWhereTheDiskFailsAtTheSameTime) {
  HungRig& rig = rig_for_good();
  EXPECT_THROW(rig.hang(GetParam(), [] { throw std::runtime_error("disk full"); }), std::runtime_error);
  EXPECT_TRUE(rig.dark_while_hung);
  EXPECT_TRUE(rig.arm_rests());
}

TEST_P(HungCycle, IsNoticedInItsVeryFirstStep) {
  HungRig& rig = rig_for_good();
  rig.gate(GetParam()).closed = true;
  const ScanResult result = rig.hang(GetParam());
  EXPECT_THAT(result.status, HasSubstr("stopped: cycle: hangs: no step for "));
  EXPECT_FALSE(result.left.safe());
}

INSTANTIATE_TEST_SUITE_P(Inside, HungCycle, testing::Values(Inside::kArm, Inside::kLaser),
                         [](const auto& where) { return where.param == Inside::kArm ? "TheArm" : "TheLaser"; });

}  // namespace
}  // namespace tankrig
