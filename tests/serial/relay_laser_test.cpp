#include "drivers/laser/relay_laser.hpp"

#include <gmock/gmock.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <memory>
#include <random>
#include <thread>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "core/thread_priority.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "rig/platform/real_time_settings.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/held_thread.hpp"
#include "tests/support/named_thread.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using sim::MockLaser;
using sim::RelayEmulator;
using sim::RelayEmulatorSettings;
using sim::RelayFault;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;

/// A box on a line in a folder of its own. Time-outs are long: what a test does not provoke must not happen on a loaded
/// machine.
struct Box {
  TemporaryFolder folder;
  MonotonicClock clock;
  RelayEmulatorSettings emulation{.name = folder.path() / "laser", .watchdog = 10s};
  RelayLaserSettings settings{.serial = {.device = (folder.path() / "laser").string(), .baud = 9600},
                              .warm_up = 20ms,
                              .answer_timeout = 500ms,
                              .caller_timeout = 60s,
                              .opening_timeout = 10s};
  MockLaser lamp{20ms, clock};
  std::unique_ptr<RelayEmulator> emulator;

  RelayEmulator& start() {
    emulator = std::make_unique<RelayEmulator>(emulation, lamp);
    return *emulator;
  }
  void with_status() { settings.protocol.status_query = emulation.protocol.status_query = '?'; }
  bool lamp_powered() { return lamp.state().value().powered; }
};

bool reaches(RelayLaser& laser, bool powered) {
  return wait_until([&] {
    const auto s = laser.state();
    return s.ok() && s.value().powered == powered;
  });
}

bool fails_with(RelayLaser& laser, ErrorCode code) {
  return wait_until([&] {
    const auto s = laser.state();
    return !s.ok() && s.error().code == code;
  });
}

bool recovers(RelayLaser& laser) {
  return wait_until([&] { return laser.state().ok(); });
}

double count(const RelayLaser& laser, const std::string& name) {
  for (const Statistic& s : laser.statistics())
    if (s.name == name) return s.value;
  ADD_FAILURE() << "no statistic " << name;
  return -1;
}

TEST(RelayLaser, TellsThatItsThreadHangsAndTheBoxOpensByItself) {
  Box box;
  box.emulation.watchdog = 2s;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  {
    const testing_support::HeldThread held("laser-relay");
    ASSERT_TRUE(held.found());
    EXPECT_TRUE(fails_with(laser, ErrorCode::kInternal));
    EXPECT_FALSE(laser.set(true).ok());
    EXPECT_TRUE(laser.set(false).ok());
    EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  }
  EXPECT_TRUE(recovers(laser));
  EXPECT_FALSE(emulator.relay_closed()) << "off was wished for meanwhile";
}

TEST(RelayLaser, SendsOffFirstAndThenSwitchesTheSupply) {
  Box box;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  EXPECT_THAT(emulator.take_received(), Each(2));
  LaserState s = laser.state().value();
  EXPECT_FALSE(s.commanded || s.powered || s.emitting);
  EXPECT_EQ(s.interlock_closed, std::nullopt);
  ASSERT_TRUE(laser.set(true).ok());
  EXPECT_TRUE(laser.state().value().commanded);
  ASSERT_TRUE(reaches(laser, true));
  EXPECT_TRUE(box.lamp_powered());
  ASSERT_TRUE(laser.set(false).ok());
  EXPECT_FALSE(laser.state().value().commanded);
  ASSERT_TRUE(reaches(laser, false));
  EXPECT_FALSE(box.lamp_powered());
  EXPECT_EQ(count(laser, "echoes_missing"), 0);
  EXPECT_EQ(count(laser, "wrong_echoes"), 0);
}

TEST(RelayLaser, EmitsAfterItsWarmUpAndSaysSinceWhen) {
  Box box;
  box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  ASSERT_TRUE(wait_until([&] { return laser.state().value().emitting; }));
  const LaserState lit = laser.state().value();
  EXPECT_GE(lit.since, box.lamp.state().value().since);  // the echo comes after the contact
  ASSERT_TRUE(laser.set(false).ok());
  ASSERT_TRUE(reaches(laser, false));
  const LaserState dark = laser.state().value();
  EXPECT_FALSE(dark.emitting);
  EXPECT_GT(dark.since, lit.since);
}

TEST(RelayLaser, RefreshesItsCommand) {
  Box box;
  box.settings.refresh = 5ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.take_received();
  const double before = count(laser, "refreshes");
  ASSERT_TRUE(wait_until([&] { return count(laser, "refreshes") >= before + 5; }));
  EXPECT_THAT(emulator.take_received(), Each(1));
}

TEST(RelayLaser, TheLastByteOnTheWireIsOff) {
  Box box;
  RelayEmulator& emulator = box.start();
  {
    RelayLaser laser(box.settings);
    ASSERT_TRUE(laser.set(true).ok());
    ASSERT_TRUE(reaches(laser, true));
  }
  EXPECT_EQ(emulator.take_received().back(), 2);
  EXPECT_FALSE(emulator.relay_closed());
  EXPECT_FALSE(box.lamp_powered());
}

TEST(RelayLaser, TheRelayOpensWhenTheProcessIsKilled) {
  Box box;
  box.emulation.watchdog = 1s;
  box.settings.refresh = 20ms;
  int ready[2], lit[2];
  ASSERT_EQ(::pipe(ready), 0);
  ASSERT_EQ(::pipe(lit), 0);
  const pid_t child = ::fork();  // before any thread
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    char go = 0;
    [[maybe_unused]] ssize_t n = ::read(ready[0], &go, 1);
    RelayLaser laser(box.settings);
    const bool on = laser.set(true).ok() && reaches(laser, true);
    go = on ? 'y' : 'n';
    n = ::write(lit[1], &go, 1);
    for (;;) ::pause();
  }
  ::close(ready[0]);
  ::close(lit[1]);
  RelayEmulator& emulator = box.start();
  char word = 'g';
  ASSERT_EQ(::write(ready[1], &word, 1), 1);
  ASSERT_EQ(::read(lit[0], &word, 1), 1);
  ASSERT_EQ(word, 'y');
  EXPECT_TRUE(emulator.relay_closed());
  EXPECT_EQ(emulator.watchdog_openings(), 0u);
  ASSERT_EQ(::kill(child, SIGKILL), 0);
  ::waitpid(child, nullptr, 0);
  const auto killed = std::chrono::steady_clock::now();
  ASSERT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  RecordProperty("opened_after_ms", static_cast<int>((std::chrono::steady_clock::now() - killed) / 1ms));
  EXPECT_EQ(emulator.watchdog_openings(), 1u);
  EXPECT_FALSE(box.lamp_powered());
}

TEST(RelayLaser, DropsTheBeamWhenItsCallerGoesSilent) {
  Box box;
  box.settings.caller_timeout = 500ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  ASSERT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  EXPECT_EQ(count(laser, "caller_timeouts"), 1);
  EXPECT_FALSE(laser.state().value().commanded);
}

TEST(RelayLaser, ItsThreadComesRightAfterTheCycle) {
  bool granted = false;
  std::thread([&] { granted = keep_time("asks", 1); }).join();
  if (!granted) GTEST_SKIP() << "this machine does not grant SCHED_FIFO";
  Box box;
  box.start();
  const RelayLaser laser(box.settings);
  EXPECT_EQ(testing_support::fifo_priority("laser-relay"), RealTimeSettings{}.priority - 2);
}

TEST(RelayLaser, StaysOnWhileItsCallerAsksForTheState) {
  Box box;
  box.settings.caller_timeout = 5s;
  box.settings.refresh = 2ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  const double before = count(laser, "refreshes");
  ASSERT_TRUE(wait_until([&] { return laser.state().ok() && count(laser, "refreshes") > before + 50; }));
  EXPECT_TRUE(emulator.relay_closed());
}

TEST(RelayLaser, ReadsContactAndInterlockBack) {
  Box box;
  box.with_status();
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  EXPECT_EQ(laser.state().value().interlock_closed, true);
  EXPECT_GE(count(laser, "queries"), 1);
  EXPECT_EQ(laser.interlock_closed(), true);
  emulator.set_interlock_closed(false);
  EXPECT_TRUE(wait_until([&] { return laser.state().value().interlock_closed == false; }));
  EXPECT_EQ(laser.interlock_closed(), false);
  emulator.set_interlock_closed(true);
  EXPECT_TRUE(wait_until([&] { return laser.state().value().interlock_closed == true; }));
  emulator.unplug();
  EXPECT_TRUE(wait_until([&] { return !laser.interlock_closed().has_value(); }));
}

/// As the executive does until laser dark and arm at rest are confirmed.
TEST(RelayLaser, ReadsTheContactBackWhileOffIsCommandedAgainAndAgain) {
  Box box;
  box.with_status();
  box.emulation.answer_delay = 20ms;
  box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  EXPECT_TRUE(wait_until([&] { return laser.set(false).ok() && !laser.state().value().powered; }));
}

TEST(RelayLaser, TheInterlockInSeriesDarkensTheLaserWhateverIsCommanded) {
  Box box;
  box.with_status();
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(wait_until([&] { return box.lamp_powered(); }));
  emulator.set_interlock_closed(false);
  EXPECT_TRUE(wait_until([&] { return !box.lamp_powered(); }));
}

TEST(RelayLaser, ShowsAWeldedRelayAsPoweredThoughNotCommanded) {
  Box box;
  box.with_status();
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.set_welded(true);
  ASSERT_TRUE(laser.set(false).ok());
  const double before = count(laser, "queries");
  bool always_powered = true;
  ASSERT_TRUE(wait_until([&] {
    always_powered = always_powered && laser.state().value().powered;
    return count(laser, "queries") > before + 3;
  }));
  EXPECT_TRUE(always_powered) << "the echo of off is not the contact";
  EXPECT_FALSE(laser.state().value().commanded);
  emulator.set_welded(false);
  EXPECT_TRUE(wait_until([&] { return !laser.state().value().powered; })) << "off is refreshed until the contact opens";
}

TEST(RelayLaser, ShowsARelayThatOpenedByItself) {
  Box box;
  box.with_status();
  box.settings.refresh = 0ms;  // nobody feeds the watchdog
  box.emulation.watchdog = 400ms;
  box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  ASSERT_TRUE(reaches(laser, false));
  EXPECT_TRUE(laser.state().value().commanded);
}

TEST(RelayLaser, LatchesOffWhenTheRelayStopsAnswering) {
  Box box;
  box.settings.answer_timeout = 100ms;
  box.settings.refresh = 20ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(wait_until([&] { return laser.set(true).ok() && emulator.relay_closed(); }));
  emulator.set_fault(RelayFault::kSilent);
  ASSERT_TRUE(fails_with(laser, ErrorCode::kTimeout));
  EXPECT_GE(count(laser, "echoes_missing"), 2);
  EXPECT_GE(count(laser, "latched_off"), 1);
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "off is sent although nothing answers";
  const Status refused = laser.set(true);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kTimeout);
  EXPECT_STREQ(refused.error().where, "laser relay: switch on");
  EXPECT_TRUE(laser.set(false).ok());
  emulator.set_fault(RelayFault::kNone);
  ASSERT_TRUE(recovers(laser));
  EXPECT_FALSE(laser.state().value().commanded) << "on again by itself";
  EXPECT_FALSE(emulator.relay_closed());
}

TEST(RelayLaser, ReportsAndCountsWrongEchoes) {
  Box box;
  box.settings.refresh = 20ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.set_fault(RelayFault::kWrongEcho);
  ASSERT_TRUE(fails_with(laser, ErrorCode::kProtocol));
  EXPECT_GE(count(laser, "wrong_echoes"), 2);
  EXPECT_EQ(count(laser, "latched_off"), 1);
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  emulator.set_fault(RelayFault::kNone);
  EXPECT_TRUE(recovers(laser));
}

TEST(RelayLaser, ReportsNoiseOnTheLine) {
  Box box;
  box.settings.refresh = 20ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  emulator.set_fault(RelayFault::kGarbage);
  ASSERT_TRUE(fails_with(laser, ErrorCode::kProtocol));
  emulator.set_fault(RelayFault::kNone);
  EXPECT_TRUE(recovers(laser));
}

/// The box hears well: only its own words are lost in the noise.
TEST(RelayLaser, SendsOffThroughNoiseThatNeverEndsUntilItIsConfirmed) {
  TemporaryFolder folder;
  sim::Pty pty(folder.path() / "laser");
  const RelayLaserSettings settings{.serial = {.device = pty.name().string(), .baud = 9600},
                                    .refresh = 0ms,
                                    .answer_timeout = 500ms,
                                    .caller_timeout = 60s,
                                    .opening_timeout = 10s};
  const auto hears = [&](std::uint8_t wanted) {
    std::uint8_t byte = 0;
    return pty.try_read({&byte, 1}).value() == 1 && byte == wanted;
  };
  const auto say = [&](std::uint8_t byte) { (void)pty.try_write({&byte, 1}); };
  const auto echo = [&](std::uint8_t byte) {
    if (hears(byte)) say(byte);
  };
  std::thread opens([&] {
    EXPECT_TRUE(wait_until([&] { return hears(2); }));
    say(2);
  });
  RelayLaser laser(settings);
  opens.join();
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(wait_until([&] {
    echo(1);
    return laser.state().ok() && laser.state().value().powered;
  }));
  const auto in_noise = [&](const auto& condition) {
    return wait_until(
        [&] {
          say(0xFF);
          return condition();
        },
        3s);
  };
  ASSERT_TRUE(in_noise([&] { return !laser.state().ok(); }));
  ASSERT_TRUE(laser.set(false).ok());
  for (int time = 1; time <= 3; ++time) ASSERT_TRUE(in_noise([&] { return hears(2); })) << "time " << time;
  EXPECT_FALSE(laser.state().ok()) << "nothing has confirmed it";
  EXPECT_TRUE(wait_until([&] {
    echo(2);
    return laser.state().ok();
  }));
  EXPECT_FALSE(laser.state().value().powered);
}

TEST(RelayLaser, OffOvertakesAnOnThatIsNotAnswered) {
  Box box;
  box.settings.answer_timeout = 60s;
  box.emulation.watchdog = 0s;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  emulator.set_fault(RelayFault::kSilent);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(wait_until([&] { return emulator.relay_closed(); }));
  ASSERT_TRUE(laser.set(false).ok());
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "waits for the echo of on";
  emulator.set_fault(RelayFault::kNone);
}

TEST(RelayLaser, TheEchoOfAnOvertakenOnIsExpected) {
  Box box;
  box.settings.answer_timeout = 10s;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  emulator.set_answer_delay(100ms);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(wait_until([&] { return emulator.relay_closed(); }));
  ASSERT_TRUE(laser.set(false).ok());
  ASSERT_TRUE(wait_until([&] { return count(laser, "slowest_answer_ms") >= 100; }));
  EXPECT_EQ(count(laser, "wrong_echoes"), 0);
  EXPECT_FALSE(laser.state().value().powered);
}

TEST(RelayLaser, AnAnswerThatComesLateIsNoWrongOne) {
  Box box;
  box.settings.answer_timeout = 100ms;
  box.settings.attempts = 10;
  box.settings.refresh = 0ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  emulator.set_answer_delay(250ms);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(wait_until([&] { return count(laser, "late_answers") >= 2; }));
  EXPECT_GE(count(laser, "echoes_missing"), 2);
  EXPECT_EQ(count(laser, "wrong_echoes"), 0);
  EXPECT_TRUE(reaches(laser, true));
}

TEST(RelayLaser, SendsOffFirstWhenTheLineIsBackAndStaysOff) {
  Box box;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.unplug();
  ASSERT_TRUE(fails_with(laser, ErrorCode::kDisconnected));
  EXPECT_EQ(count(laser, "disconnects"), 1);
  EXPECT_EQ(laser.set(true).error().code, ErrorCode::kDisconnected);
  emulator.take_received();
  emulator.plug();
  ASSERT_TRUE(recovers(laser));
  EXPECT_EQ(count(laser, "reconnects"), 1);
  EXPECT_THAT(emulator.take_received(), Each(2));
  EXPECT_FALSE(laser.state().value().commanded);
  EXPECT_FALSE(emulator.relay_closed());
  ASSERT_TRUE(laser.set(true).ok());
  EXPECT_TRUE(reaches(laser, true));
}

TEST(RelayLaser, EndsPromptlyWhileTheLineIsAway) {
  Box box;
  RelayEmulator& emulator = box.start();
  auto laser = std::make_unique<RelayLaser>(box.settings);
  emulator.unplug();
  ASSERT_TRUE(fails_with(*laser, ErrorCode::kDisconnected));
  const auto begin = std::chrono::steady_clock::now();
  laser.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

TEST(RelayLaser, RefusesToOpenAHalfOpenLine) {
  Box box;
  RelayEmulator& emulator = box.start();
  emulator.set_fault(RelayFault::kDead);
  box.settings.opening_timeout = 100ms;
  box.settings.answer_timeout = 20ms;
  const std::string message = message_of<InputError>([&] { RelayLaser{box.settings}; });
  EXPECT_THAT(message, HasSubstr("laser relay: no answer to off (0x02) within 100 ms: check its power and cable"));
  EXPECT_THAT(message, HasSubstr(box.settings.serial.device));
}

TEST(RelayLaser, RefusesAnotherDeviceOnItsLine) {
  Box box;
  box.start().set_fault(RelayFault::kWrongEcho);
  box.settings.answer_timeout = 100ms;
  box.settings.opening_timeout = 1s;
  EXPECT_THAT(message_of<InputError>([&] { RelayLaser{box.settings}; }),
              HasSubstr("laser relay: answers 0xa6 to off (0x02), expected an echo"));
}

TEST(RelayLaser, RefusesABoxWithoutTheStatusThatIsConfigured) {
  Box box;
  box.settings.protocol.status_query = '?';
  box.settings.opening_timeout = 1s;
  box.settings.answer_timeout = 100ms;
  box.start();
  EXPECT_THAT(message_of<InputError>([&] { RelayLaser{box.settings}; }),
              HasSubstr("gives no status to 0x3f: correct `status_query`"));
}

TEST(RelayLaser, SwitchesByTheBytesOfTheRigFile) {
  Box box;
  box.settings.protocol = box.emulation.protocol = {.on_byte = 'A', .off_byte = 'Z', .status_query = 'S'};
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(laser.set(true).ok());
  ASSERT_TRUE(reaches(laser, true));
  EXPECT_THAT(emulator.take_received(), Contains('A'));
}

TEST(RelayProtocol, AStatusIsNeverTakenForAnEcho) {
  for (int byte = 0; byte < 256; ++byte) {
    const auto status = decode_relay_status(static_cast<std::uint8_t>(byte));
    ASSERT_EQ(status.has_value(), byte >= 0x50 && byte <= 0x53) << byte;
    if (status) {
      EXPECT_EQ(relay_status_byte(*status), byte);
    }
  }
  EXPECT_EQ(decode_relay_status(0x51), (RelayStatus{.closed = true, .interlock_closed = false}));
  EXPECT_EQ(decode_relay_status(0x52), (RelayStatus{.closed = false, .interlock_closed = true}));
}

TEST(RelayLaser, SurvivesAnyBytesAndIsNeverPoweredBecauseOfThem) {
  const unsigned seed = 20240607;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  TemporaryFolder folder;
  sim::Pty pty(folder.path() / "laser");
  RelayLaserSettings settings{.serial = {.device = pty.name().string(), .baud = 9600}, .opening_timeout = 10s};
  std::thread box([&] {
    const std::uint8_t off = 2;
    wait_until([&] {
      std::uint8_t byte = 0;
      return pty.try_read({&byte, 1}).value() == 1 && byte == 2;
    });
    ASSERT_TRUE(pty.try_write({&off, 1}).ok());
  });
  RelayLaser laser(settings);
  box.join();
  for (int i = 0; i < 2000; ++i) {
    std::array<std::uint8_t, 16> noise;
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    ASSERT_TRUE(pty.try_write(noise).ok());
    const auto s = laser.state();
    ASSERT_FALSE(s.ok() && (s.value().powered || s.value().commanded));
    std::array<std::uint8_t, 64> heard;
    const auto got = pty.try_read(heard);
    for (std::size_t k = 0; got.ok() && k < got.value(); ++k) ASSERT_EQ(heard[k], 2);
  }
}

TEST(RelayLaserSettings, AreReadFromTheRigFile) {
  TemporaryFolder folder;
  const auto file = folder.write("rig.yaml",
                                 "driver: relay\ndevice: runtime/laser\nbaud: 19200\non_byte: 65\noff_byte: 66\n"
                                 "status_query: 63\nwarm_up_s: 2.5\nrefresh_ms: 100\nquery_period_ms: 40\n"
                                 "answer_timeout_ms: 30\nattempts: 3\ncaller_timeout_ms: 700\nopening_timeout_s: 4\n");
  const ConfigNode node = ConfigNode::load(file);
  EXPECT_EQ(node.text("driver"), "relay");
  const RelayLaserSettings s = relay_laser_settings_from(node, "/run/tankrig");
  node.finish();
  EXPECT_EQ(s.serial.device, "/run/tankrig/laser");
  EXPECT_EQ(s.serial.baud, 19200);
  EXPECT_EQ(s.protocol.on_byte, 65);
  EXPECT_EQ(s.protocol.off_byte, 66);
  EXPECT_EQ(s.protocol.status_query, 63);
  EXPECT_EQ(s.warm_up, 2500ms);
  EXPECT_EQ(s.refresh, 100ms);
  EXPECT_EQ(s.query_period, 40ms);
  EXPECT_EQ(s.answer_timeout, 30ms);
  EXPECT_EQ(s.attempts, 3);
  EXPECT_EQ(s.caller_timeout, 700ms);
  EXPECT_EQ(s.opening_timeout, 4s);
}

TEST(RelayEmulatorSettings, FollowTheDeviceOfTheRigFile) {
  TemporaryFolder folder;
  const ConfigNode rig = ConfigNode::load(folder.write("rig.yaml",
                                                       "laser: {device: runtime/laser, on_byte: 7, status_query: 3}\n"
                                                       "emulation: {watchdog_ms: 400, answer_delay_ms: 2}\n"));
  const ConfigNode emulation = rig.child("emulation");
  const auto s = sim::relay_emulator_settings_from(rig.child("laser"), &emulation, "/run/tankrig");
  rig.finish();
  EXPECT_EQ(s.name, "/run/tankrig/laser");
  EXPECT_EQ(s.protocol.on_byte, 7);
  EXPECT_EQ(s.protocol.off_byte, 2);
  EXPECT_EQ(s.protocol.status_query, 3);
  EXPECT_EQ(s.watchdog, 400ms);
  EXPECT_EQ(s.answer_delay, 2ms);
  EXPECT_EQ(sim::relay_emulator_settings_from(rig.child("laser"), nullptr, "/run").watchdog, 1s);
}

TEST(RelayLaserSettings, RefuseBytesThatCannotBeToldApart) {
  TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", "device: /dev/ttyACM0\n" + text));
    return message_of<InputError>([&] { relay_laser_settings_from(node, "/run"); });
  };
  EXPECT_THAT(message("on_byte: 2\n"), HasSubstr("off_byte: is the same as on_byte"));
  EXPECT_THAT(message("status_query: 1\n"), HasSubstr("rig.yaml:2: status_query: is the same as on_byte or off_byte"));
  EXPECT_THAT(message("on_byte: 256\n"), HasSubstr("expected a number from 0 to 255"));
}

TEST(RelayLaserSettings, RefuseALaserThatWouldGoOffAfterTheArmIsStopped) {
  TemporaryFolder folder;
  const auto message = [&](const std::string& text, Duration watchdog) {
    const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", "device: /dev/ttyACM0\n" + text));
    return message_of<InputError>(
        [&] { check_goes_off_first(node, relay_laser_settings_from(node, "/run"), watchdog); });
  };
  EXPECT_THAT(message("caller_timeout_ms: 0\n", 500ms), HasSubstr("rig.yaml:2: caller_timeout_ms: "));
  EXPECT_THAT(message("caller_timeout_ms: 500\n", 500ms),
              HasSubstr("rig.yaml:2: caller_timeout_ms: found 500, expected less than the arm's watchdog_ms (500)"));
  EXPECT_THAT(message("", 250ms), HasSubstr("caller_timeout_ms: found 250, expected less than"));
  const ConfigNode usual = ConfigNode::load(folder.write("rig.yaml", "device: /dev/ttyACM0\n"));
  EXPECT_NO_THROW(check_goes_off_first(usual, relay_laser_settings_from(usual, "/run"), Arm5eSettings{}.watchdog));
}

}  // namespace
}  // namespace tankrig
