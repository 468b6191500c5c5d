// The relay's driver where box or line fail: told, counted, and off before all else.
#include <gmock/gmock.h>

#include <array>
#include <random>
#include <thread>

#include "core/input_error.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "tests/serial/relay_box.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/held_thread.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using namespace testing_support;
using sim::RelayEmulator;
using sim::RelayFault;
using ::testing::Each;
using ::testing::HasSubstr;

TEST(RelayLaser, TellsThatItsThreadHangsAndTheBoxOpensByItself) {
  Box box;
  box.emulation.watchdog = 2s;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  {
    const testing_support::HeldThread held("laser-relay");
    ASSERT_TRUE(held.found());
    EXPECT_TRUE(fails_with(laser, ErrorCode::kInternal));
    EXPECT_FALSE(BenchRight::light(laser).ok());
    EXPECT_TRUE(laser.off().ok());
    EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  }
  EXPECT_TRUE(recovers(laser));
  EXPECT_FALSE(emulator.relay_closed()) << "off was wished for meanwhile";
}

TEST(RelayLaser, ShowsAWeldedRelayAsPoweredThoughNotCommanded) {
  Box box;
  box.with_status();
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.set_welded(true);
  ASSERT_TRUE(laser.off().ok());
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
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
  ASSERT_TRUE(wait_until([&] { return BenchRight::light(laser).ok() && emulator.relay_closed(); }));
  emulator.set_fault(RelayFault::kSilent);
  ASSERT_TRUE(fails_with(laser, ErrorCode::kTimeout));
  EXPECT_GE(count(laser, "echoes_missing"), 2);
  EXPECT_GE(count(laser, "latched_off"), 1);
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "off is sent although nothing answers";
  const Status refused = BenchRight::light(laser);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kTimeout);
  EXPECT_STREQ(refused.error().where, "laser relay: switch on");
  EXPECT_TRUE(laser.off().ok());
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
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
  ASSERT_TRUE(laser.off().ok());
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(wait_until([&] { return emulator.relay_closed(); }));
  ASSERT_TRUE(laser.off().ok());
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "waits for the echo of on";
  emulator.set_fault(RelayFault::kNone);
}

TEST(RelayLaser, TheEchoOfAnOvertakenOnIsExpected) {
  Box box;
  box.settings.answer_timeout = 10s;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  emulator.set_answer_delay(100ms);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(wait_until([&] { return emulator.relay_closed(); }));
  ASSERT_TRUE(laser.off().ok());
  ASSERT_TRUE(wait_until([&] { return count(laser, "slowest_answer_ms") >= 100; }));
  EXPECT_TRUE(reaches(laser, false));
  EXPECT_EQ(count(laser, "wrong_echoes"), 0);
}

TEST(RelayLaser, AnAnswerThatComesLateIsNoWrongOne) {
  Box box;
  box.settings.answer_timeout = 100ms;
  box.settings.attempts = 10;
  box.settings.refresh = 0ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  emulator.set_answer_delay(250ms);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(wait_until([&] { return count(laser, "late_answers") >= 2; }));
  EXPECT_GE(count(laser, "echoes_missing"), 2);
  EXPECT_EQ(count(laser, "wrong_echoes"), 0);
  EXPECT_TRUE(reaches(laser, true));
}

TEST(RelayLaser, SendsOffFirstWhenTheLineIsBackAndStaysOff) {
  Box box;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.unplug();
  ASSERT_TRUE(fails_with(laser, ErrorCode::kDisconnected));
  EXPECT_EQ(count(laser, "disconnects"), 1);
  EXPECT_EQ(BenchRight::light(laser).error().code, ErrorCode::kDisconnected);
  emulator.take_received();
  emulator.plug();
  ASSERT_TRUE(recovers(laser));
  EXPECT_EQ(count(laser, "reconnects"), 1);
  EXPECT_THAT(emulator.take_received(), Each(2));
  EXPECT_FALSE(laser.state().value().commanded);
  EXPECT_FALSE(emulator.relay_closed());
  ASSERT_TRUE(BenchRight::light(laser).ok());
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

}  // namespace
}  // namespace tankrig
