// The program's end of the watchdog box, and the box's, on one line in real time.
#include "drivers/watchdog/watchdog_box.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "drivers/serial/serial_port.hpp"
#include "rig/executive/executive.hpp"
#include "rig/plan/operator_plan.hpp"
#include "sim_backends/wire/arm_electronics.hpp"
#include "sim_backends/wire/box_emulator.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using testing_support::CallLog;
using testing_support::FakeArm;
using testing_support::FakeLaser;
using testing_support::MachineWitness;

struct BoxBench {
  MonotonicClock clock;
  TemporaryFolder folder;
  std::atomic<int> switchings{0};
  sim::BoxEmulator emulator;
  WatchdogBox box;
  explicit BoxBench(bool nobody_there = false)
      : emulator({.name = folder.path() / "box", .reset_after = 50ms, .nobody_there = nobody_there},
                 [this](bool) { ++switchings; }),
        box({.heartbeat = {.kind = HeartbeatKind::kBytes, .device = folder.path() / "box"},
             .enable = {.kind = EnableKind::kReply}},
            "/", clock) {}

  /// Calls `each` every 5 ms until it is true; false at the deadline.
  template <class Each>
  bool until(Each each, Duration deadline = 10s) {
    for (const Stamp end = clock.now() + deadline; clock.now() < end; clock.sleep_until(clock.now() + 5ms))
      if (each()) return true;
    return false;
  }
  bool becomes_enabled() {
    return until([&] {
      BenchRight::complete(box);
      return box.enabled(clock.now());
    });
  }
};

TEST(WatchdogBox, IsEnabledOnceStepsAreCompletedAndItsButtonIsPressed) {
  BoxBench bench;
  EXPECT_FALSE(bench.box.enabled(bench.clock.now()));
  ASSERT_TRUE(bench.becomes_enabled());
  EXPECT_TRUE(bench.emulator.closed());
  EXPECT_EQ(bench.switchings, 1);
}

TEST(WatchdogBox, StaysOpenWhileNobodyPressesItsButton) {
  BoxBench bench(true);
  EXPECT_FALSE(bench.until(
      [&] {
        BenchRight::complete(bench.box);
        return bench.box.enabled(bench.clock.now());
      },
      1s));
  EXPECT_GT(bench.emulator.edges(), 20u);
}

TEST(WatchdogBox, OpensAtMost200MillisecondsAfterTheLastEdgeOnceNoStepIsCompleted) {
  const MachineWitness witness;
  BoxBench bench;
  ASSERT_TRUE(bench.becomes_enabled());
  const Stamp last_step = bench.clock.now();
  ASSERT_TRUE(bench.until([&] { return !bench.emulator.closed(); }));
  const std::uint64_t edges = bench.emulator.edges();
  ASSERT_TRUE(bench.until([&] { return !bench.box.enabled(bench.clock.now()); }));
  EXPECT_EQ(bench.emulator.edges(), edges);
  TANKRIG_SKIP_IF_LATE(witness, 15ms);
  EXPECT_LE(*bench.emulator.opened() - *bench.emulator.last_edge(), 200ms);
  EXPECT_LE(*bench.emulator.last_edge() - last_step, 35ms) << "one half period";
}

TEST(WatchdogBox, IsNotEnabledSoonAfterItsLineIsPulled) {
  const MachineWitness witness;
  BoxBench bench;
  ASSERT_TRUE(bench.becomes_enabled());
  const Stamp pulled = bench.clock.now();
  bench.emulator.unplug();
  ASSERT_TRUE(bench.until([&] {
    BenchRight::complete(bench.box);
    return !bench.box.enabled(bench.clock.now());
  }));
  const Duration noticed = bench.clock.now() - pulled;
  TANKRIG_SKIP_IF_LATE(witness, 15ms);
  EXPECT_LE(noticed, WatchdogBox::kFresh + 60ms);
}

/// A plan that stays where it is, stepped every 5 ms.
struct WatchedExecutive : BoxBench {
  CallLog log;
  JointVector q = (JointVector() << 0, 0.13, 0.9, 0, 0.1).finished();
  FakeArm arm{log, q};
  FakeLaser laser{log};
  ScanSettings settings;
  ScanPlan plan = make_move_plan(settings, q, (JointVector() << 0, 0.13, 1.2, 0, 0.1).finished(), "move");
  Executive executive{plan, settings, arm, laser};
  CycleRecord last;

  WatchedExecutive() {
    settings.control.feed_forward_lead = 0;
    executive.watch_by(&box);
  }
  void step() {
    const Stamp now = clock.now();
    arm.advance(now);
    executive.heartbeat(now);
    executive.step(now);
    while (executive.try_pop(last)) {
    }
  }
};

TEST(WatchdogBox, LetsNothingMoveBeforeItIsEnabledAndFaultsWhenItOpens) {
  WatchedExecutive rig;
  ASSERT_TRUE(rig.until([&] {
    rig.step();
    return rig.box.enabled(rig.clock.now());
  }));
  EXPECT_EQ(rig.log.first("velocity") < rig.log.count, true) << "rest is always allowed";
  EXPECT_TRUE(rig.arm.velocity().isZero(0));
  rig.executive.start(rig.clock.now() + 10ms);
  ASSERT_TRUE(rig.until([&] {
    rig.step();
    return !rig.arm.velocity().isZero(0);
  })) << to_string(rig.last.fault);
  rig.emulator.unplug();
  ASSERT_TRUE(rig.until([&] {
    rig.step();
    return rig.last.fault != Fault::kNone;
  }));
  EXPECT_EQ(rig.last.fault, Fault::kDisabled) << to_string(rig.last.fault) << " " << rig.last.error.where;
  EXPECT_TRUE(rig.arm.velocity().isZero(0));
}

TEST(WatchdogBox, OpensWhenTheArmDoesNotTakeItsRest) {
  WatchedExecutive rig;
  ASSERT_TRUE(rig.until([&] {
    rig.step();
    return rig.box.enabled(rig.clock.now());
  }));
  rig.executive.request_stop();
  rig.arm.fail_stop = true;
  EXPECT_TRUE(rig.until([&] {
    rig.step();
    return !rig.emulator.closed();
  })) << "a step whose outputs are not taken is not completed";
}

/// What EmulatedTank does with its contactors.
TEST(WatchdogBox, FeedsTheEmulatedMotorsAndTheLaser) {
  BoxBench bench;
  sim::ArmElectronics arm(arm5e(), {.needs_gains = false}, bench.clock);
  sim::ArmRequest drive;
  drive.slots.fill(encode(DemandSlot{DemandType::kSpeedForward, 500, kLargestSpeed, kLargestSpeed}));
  const auto speed_when = [&](bool fed) {
    arm.set_fed(fed);
    arm.request(drive, bench.clock.now());
    bench.clock.sleep_until(bench.clock.now() + 300ms);
    return arm.true_velocity_at(bench.clock.now()).cwiseAbs().maxCoeff();
  };
  EXPECT_GT(speed_when(true), 0.01);
  EXPECT_LT(speed_when(false), 1e-3) << "though it is demanded";
  EXPECT_FALSE(arm.rest_since()) << "no demand for rest was on the wire";
  sim::MockLaser lamp(Duration{0}, bench.clock);
  sim::RelayEmulator relay({.name = bench.folder.path() / "laser", .watchdog = Duration{0}}, lamp);
  relay.set_fed(false);
  SerialPort line({.device = bench.folder.path() / "laser", .baud = 9600});
  const std::uint8_t on = RelayProtocol{}.on_byte;
  ASSERT_TRUE(line.try_write({&on, 1}).ok());
  ASSERT_TRUE(bench.until([&] { return relay.relay_closed(); }));
  EXPECT_EQ(lamp.power_at(bench.clock.now()), 0);
  relay.set_fed(true);
  EXPECT_TRUE(bench.until([&] { return lamp.power_at(bench.clock.now()) > 0; }));
  relay.set_fed(false);
  EXPECT_TRUE(bench.until([&] { return lamp.power_at(bench.clock.now()) == 0; }));
}

std::string refusal(const WatchdogSettings& settings) {
  try {
    const MonotonicClock clock;
    const WatchdogBox box(settings, "/", clock);
  } catch (const InputError& e) {
    return e.what();
  }
  return "opened";
}

TEST(WatchdogBox, ThatIsNotThereIsRefusedWithTheCure) {
  const TemporaryFolder folder;
  const std::string line = folder.path() / "line";
  const sim::Pty silent(line);
  EXPECT_THAT(
      refusal({.heartbeat = {.kind = HeartbeatKind::kBytes, .device = line}, .enable = {.kind = EnableKind::kReply}}),
      HasSubstr("says nothing, expected a reply within a second: switch it on, check its cable, or take "
                "enable_input out of the rig file"));
  EXPECT_THAT(refusal({.heartbeat = {.kind = HeartbeatKind::kBytes, .device = line + "x"}}), HasSubstr(line + "x"));
  EXPECT_THAT(refusal({.heartbeat = {.kind = HeartbeatKind::kRts, .device = line}}),
              HasSubstr("heartbeat_output: " + line + " has no control lines"));
  EXPECT_THAT(refusal({.enable = {.kind = EnableKind::kCts, .device = line}}),
              HasSubstr("enable_input: " + line + " has no control lines"));
  EXPECT_THAT(refusal({.enable = {.kind = EnableKind::kCts}}), HasSubstr("found no device"));
  EXPECT_THAT(
      refusal({.heartbeat = {.kind = HeartbeatKind::kRts, .device = line}, .enable = {.kind = EnableKind::kReply}}),
      HasSubstr("expected heartbeat_output of kind bytes on the same line"));
}

}  // namespace
}  // namespace tankrig
