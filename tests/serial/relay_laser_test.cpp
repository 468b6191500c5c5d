// The relay's driver on a line that works: it switches, refreshes and reads back.
#include "drivers/laser/relay_laser.hpp"

#include <gmock/gmock.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "core/thread_priority.hpp"
#include "rig/platform/real_time_settings.hpp"
#include "tests/serial/relay_box.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/named_thread.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using namespace testing_support;
using sim::RelayEmulator;
using ::testing::Contains;
using ::testing::Each;

TEST(RelayLaser, SendsOffFirstAndThenSwitchesTheSupply) {
  Box box;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  EXPECT_THAT(emulator.take_received(), Each(2));
  LaserState s = laser.state().value();
  EXPECT_FALSE(s.commanded || s.powered || s.emitting);
  EXPECT_EQ(s.interlock_closed, std::nullopt);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  EXPECT_TRUE(laser.state().value().commanded);
  ASSERT_TRUE(reaches(laser, true));
  EXPECT_TRUE(box.lamp_powered());
  ASSERT_TRUE(laser.off().ok());
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  ASSERT_TRUE(wait_until([&] { return laser.state().value().emitting; }));
  const LaserState lit = laser.state().value();
  EXPECT_GE(lit.since, box.lamp.state().value().since);  // the echo comes after the contact
  ASSERT_TRUE(laser.off().ok());
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.take_received();
  int received = 0;
  EXPECT_TRUE(wait_until([&] {
    const auto bytes = emulator.take_received();
    EXPECT_THAT(bytes, Each(1));
    received += static_cast<int>(bytes.size());
    return received >= 5;
  }));
}

TEST(RelayLaser, TheLastByteOnTheWireIsOff) {
  Box box;
  RelayEmulator& emulator = box.start();
  {
    RelayLaser laser(box.settings);
    ASSERT_TRUE(BenchRight::light(laser).ok());
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
    const bool on = BenchRight::light(laser).ok() && reaches(laser, true);
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
  EXPECT_TRUE(wait_until([&] { return emulator.watchdog_openings() == 1 && !box.lamp_powered(); }));
}

TEST(RelayLaser, DropsTheBeamWhenItsCallerGoesSilent) {
  Box box;
  box.settings.caller_timeout = 500ms;
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  ASSERT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  EXPECT_EQ(count(laser, "caller_timeouts"), 1);
  EXPECT_FALSE(laser.state().value().commanded);
}

TEST(RelayLaser, ItsThreadComesRightAfterTheCycle) {
  bool granted = false;
  std::thread([&] { granted = set_fifo("asks", 1); }).join();
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
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
  EXPECT_TRUE(wait_until([&] { return laser.interlock_closed() == false; }));
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
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  EXPECT_TRUE(wait_until([&] { return laser.off().ok() && !laser.state().value().powered; }));
}

TEST(RelayLaser, TheInterlockInSeriesDarkensTheLaserWhateverIsCommanded) {
  Box box;
  box.with_status();
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(wait_until([&] { return box.lamp_powered(); }));
  emulator.set_interlock_closed(false);
  EXPECT_TRUE(wait_until([&] { return !box.lamp_powered(); }));
}

TEST(RelayLaser, SwitchesByTheBytesOfTheRigFile) {
  Box box;
  box.settings.protocol = box.emulation.protocol = {.on_byte = 'A', .off_byte = 'Z', .status_query = 'S'};
  RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
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

}  // namespace
}  // namespace tankrig
