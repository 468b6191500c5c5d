// The proof test of the relay's own watchdog: refreshes are withheld, and its contact is read back open by itself.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/serial/relay_box.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::Box;
using testing_support::reaches;

/// Lit, and nothing refreshed any more.
void light_and_withhold(Box& box, RelayLaser& laser) {
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  laser.withhold_refreshes(true);
  EXPECT_EQ(laser.opened_by_itself(), std::nullopt);
  box.emulator->take_received();
}

TEST(RelayProof, MeasuresHowSoonARelayWithAWatchdogOpensByItself) {
  Box box;
  box.with_status();
  box.settings.refresh = 20ms;
  box.emulation.watchdog = 400ms;
  box.start();
  RelayLaser laser(box.settings);
  light_and_withhold(box, laser);
  ASSERT_TRUE(wait_until([&] { return laser.opened_by_itself().has_value(); }));
  EXPECT_GE(*laser.opened_by_itself(), 400ms);
  const auto sent = box.emulator->take_received();
  EXPECT_LE(std::count(sent.begin(), sent.end(), 1), 1) << "one may have been on its way";
  EXPECT_EQ(std::count(sent.begin(), sent.end(), 2), 0);
  EXPECT_TRUE(laser.state().value().commanded);
  laser.withhold_refreshes(false);
  EXPECT_TRUE(reaches(laser, true)) << "it is refreshed again";
  laser.withhold_refreshes(true);
  EXPECT_EQ(laser.opened_by_itself(), std::nullopt) << "of an earlier proof";
}

TEST(RelayProof, SeesNothingOfARelayWithoutAWatchdogAndSwitchesItOff) {
  Box box;
  box.with_status();
  box.settings.refresh = 20ms;
  box.settings.query_period = 5ms;
  box.emulation.watchdog = 0s;
  sim::RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  light_and_withhold(box, laser);
  const double before = count(laser, "queries");
  ASSERT_TRUE(wait_until([&] { return laser.state().ok() && count(laser, "queries") > before + 100; }));
  EXPECT_EQ(laser.opened_by_itself(), std::nullopt);
  EXPECT_TRUE(emulator.relay_closed());
  ASSERT_TRUE(laser.off().ok());
  EXPECT_TRUE(wait_until([&] { return !emulator.relay_closed(); })) << "off is never withheld";
  EXPECT_TRUE(reaches(laser, false));
  EXPECT_EQ(laser.opened_by_itself(), std::nullopt) << "it was told to";
}

TEST(RelayProof, IsNoneWhereTheInterlockHasOpenedTheLaser) {
  Box box;
  box.with_status();
  box.settings.query_period = 5ms;
  box.emulation.watchdog = 1s;
  sim::RelayEmulator& emulator = box.start();
  RelayLaser laser(box.settings);
  ASSERT_TRUE(BenchRight::light(laser).ok());
  ASSERT_TRUE(reaches(laser, true));
  emulator.set_interlock_closed(false);
  ASSERT_TRUE(wait_until([&] { return laser.interlock_closed() == std::optional(false); }));
  laser.withhold_refreshes(true);
  ASSERT_TRUE(wait_until([&] { return !emulator.relay_closed(); }));
  const double before = count(laser, "queries");
  ASSERT_TRUE(wait_until([&] { return laser.state().ok() && count(laser, "queries") > before + 3; }));
  EXPECT_EQ(laser.opened_by_itself(), std::nullopt);
}

}  // namespace
}  // namespace tankrig
