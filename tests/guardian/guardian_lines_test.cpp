// What the guardian asks of relay and arm, and what it takes for an answer, on their emulators.
#include <gtest/gtest.h>

#include "drivers/arm/arm_requests.hpp"
#include "drivers/arm/can_arm_link.hpp"
#include "drivers/arm/serial_arm_link.hpp"
#include "rig/guardian/arm_rest.hpp"
#include "rig/guardian/relay_off.hpp"
#include "sim_backends/wire/arm_emulator.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/support/counting_new.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kDeadline = 20s;

/// Every 5 ms until `is_so`, asking every fourth time.
template <class Line, class IsSo>
bool asks_until(Line& line, IsSo is_so) {
  MonotonicClock clock;
  int round = 0;
  for (const Stamp end = clock.now() + kDeadline; clock.now() < end; clock.sleep_until(clock.now() + 5ms)) {
    if constexpr (requires { line.ask(); }) {
      line.listen();
      if (round++ % 4 == 0) line.ask();
    } else {
      line.listen(clock.now());
      if (round++ % 4 == 0) line.ask(clock.now());
    }
    if (is_so()) return true;
  }
  return false;
}

struct RelayBench {
  TemporaryFolder folder;
  MonotonicClock clock;
  sim::MockLaser lamp{20ms, clock};
  sim::RelayEmulatorSettings emulation{.name = folder.path() / "laser", .watchdog = 0s};
  SerialSettings line{.device = (folder.path() / "laser").string(), .baud = 9600};
  std::unique_ptr<sim::RelayEmulator> box;
  std::unique_ptr<SerialPort> program;

  /// The program's line, on which it has switched on.
  RelayOff off(bool with_query) {
    if (with_query) emulation.protocol.status_query = '?';
    box = std::make_unique<sim::RelayEmulator>(emulation, lamp);
    program = std::make_unique<SerialPort>(line);
    EXPECT_TRUE(program->try_write({&emulation.protocol.on_byte, 1}).ok());
    for (const Stamp end = clock.now() + kDeadline; !box->relay_closed() && clock.now() < end;)
      clock.sleep_until(clock.now() + 1ms);
    EXPECT_TRUE(box->relay_closed());
    RelayOff made(line, emulation.protocol);
    made.take(program->descriptor());
    return made;
  }
};

TEST(RelayOff, SwitchesOffOnTheProgramsLineAndHearsIt) {
  for (const bool with_query : {false, true}) {
    RelayBench bench;
    RelayOff off = bench.off(with_query);
    EXPECT_FALSE(off.dark());
    EXPECT_TRUE(asks_until(off, [&] { return off.dark(); }));
    EXPECT_FALSE(bench.box->relay_closed());
  }
}

TEST(RelayOff, IsNotDarkWhileTheContactIsWelded) {
  RelayBench bench;
  RelayOff off = bench.off(true);
  bench.box->set_welded(true);
  int asked = 0;
  EXPECT_TRUE(asks_until(off, [&] { return ++asked > 50; }));
  EXPECT_FALSE(off.dark());
}

TEST(RelayOff, FindsALineThatWasPulledAndCameBackThoughTheProgramHasGone) {
  RelayBench bench;
  RelayOff off = bench.off(true);
  bench.program.reset();
  bench.box->unplug();
  EXPECT_TRUE(asks_until(off, [&] { return off.lost(); }));
  EXPECT_FALSE(off.dark());
  bench.box->plug();
  EXPECT_TRUE(asks_until(off, [&] { return off.dark(); }));
  EXPECT_FALSE(bench.box->relay_closed());
}

TEST(RelayOff, AllocatesNothing) {
  TANKRIG_SKIP_SANITIZED(testing_support::kNoCounting);
  RelayBench bench;
  RelayOff off = bench.off(true);
  std::uint64_t most = 0;
  int asked = 0;
  EXPECT_TRUE(asks_until(off, [&] {
    const std::uint64_t before = testing_support::allocations();
    off.listen();
    off.ask();
    most = std::max(most, testing_support::allocations() - before);
    if (++asked == 25) bench.box->unplug();  // a line that is gone is opened again and again
    return asked > 50;
  }));
  EXPECT_EQ(most, 0U);
}

class ArmRestOn : public testing::TestWithParam<bool> {
 protected:
  bool serial() const { return GetParam(); }

  void make() {
    parameters.watchdog = 0s;
    parameters.needs_gains = false;
    parameters.can_paced = true;
    emulator = std::make_unique<sim::ArmEmulator>(model, parameters, clock);
    std::unique_ptr<ArmLink> link;
    if (serial()) {
      emulator->serve(folder.path() / "arm");
      settings.serial.device = folder.path() / "arm";
      link = std::make_unique<SerialArmLink>(SerialPort(settings.serial));
    } else {
      auto [host, device] = make_can_pair(clock);
      emulator->serve(std::move(device));
      link = std::make_unique<CanArmLink>(std::move(host), settings.can_ids, settings.can.bitrate);
    }
    rest.emplace(std::move(link), settings);
    ArmDemands motion = {};
    for (DemandSlot& slot : motion) slot = {DemandType::kStop, 0, 0x0FFF, 0x0FFF};
    motion[kElbow] = {DemandType::kSpeedForward, 400, 0x0FFF, 0x0FFF};
    for (const Stamp end = clock.now() + kDeadline; speed() < 0.02 && clock.now() < end;) {
      rest->link().forget();
      (void)rest->link().try_send(motion, {}, clock.now());
      alter(motion);
      clock.sleep_until(clock.now() + 20ms);
      rest->listen(clock.now());
    }
    ASSERT_GT(speed(), 0.02);
    rest->restart();
  }
  double speed() { return emulator->true_velocity_at(clock.now()).cwiseAbs().maxCoeff(); }

  TemporaryFolder folder;
  MonotonicClock clock;
  const ArmModel model = arm5e();
  sim::ArmEmulatorParameters parameters;
  Arm5eSettings settings;
  std::unique_ptr<sim::ArmEmulator> emulator;
  std::optional<ArmRest> rest;
};

INSTANTIATE_TEST_SUITE_P(Wires, ArmRestOn, testing::Bool(),
                         [](const auto& wire) { return std::string(wire.param ? "Serial" : "Can"); });

TEST_P(ArmRestOn, ComesToRestAndIsSeenThere) {
  make();
  EXPECT_FALSE(rest->rests(clock.now()));
  EXPECT_TRUE(asks_until(*rest, [&] { return rest->rests(clock.now()); }));
  EXPECT_LT(speed(), 1e-3);
}

/// It answers nothing until its request changes.
TEST_P(ArmRestOn, ReachesAnArmThatGoesMuteAtEveryOtherRequest) {
  parameters.mute_probability = 0.5;
  make();
  EXPECT_TRUE(asks_until(*rest, [&] { return speed() < 1e-3 && rest->rests(clock.now()); }));
}

TEST_P(ArmRestOn, TakesAnEncoderThatFlickersForOneAtRest) {
  make();
  sim::ArmEmulatorFaults wavers;
  wavers.wavering_joint = kSlew;  // over three values
  emulator->set_faults(wavers);
  EXPECT_TRUE(asks_until(*rest, [&] { return rest->rests(clock.now()); }));
}

TEST_P(ArmRestOn, IsNotConfirmedByAnArmThatGoesOnOrSaysNothing) {
  make();
  sim::ArmEmulatorFaults silent;
  silent.silent = true;
  emulator->set_faults(silent);
  int asked = 0;
  EXPECT_TRUE(asks_until(*rest, [&] { return ++asked > 120; }));
  EXPECT_FALSE(rest->rests(clock.now()));
}

TEST_P(ArmRestOn, AllocatesNothing) {
  TANKRIG_SKIP_SANITIZED(testing_support::kNoCounting);
  make();
  std::uint64_t most = 0;
  int asked = 0;
  EXPECT_TRUE(asks_until(*rest, [&] {
    const std::uint64_t before = testing_support::allocations();
    rest->listen(clock.now());
    rest->ask(clock.now());
    most = std::max(most, testing_support::allocations() - before);
    return ++asked > 50;
  }));
  EXPECT_EQ(most, 0U);
}

}  // namespace
}  // namespace tankrig
