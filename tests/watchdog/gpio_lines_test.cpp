// A watchdog box on GPIO lines, against a chip in this process. No chip was there to try it on.
#include <gmock/gmock.h>
#include <gpiod.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "drivers/watchdog/watchdog_lines.hpp"
#include "tests/watchdog/fake_gpiod.hpp"

namespace tankrig {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing_support::fake_gpio_chip;
using testing_support::FakeGpioChip;

WatchdogSettings both(bool closed_is_on = true) {
  return {.heartbeat = {.kind = HeartbeatKind::kGpio, .device = {}, .chip = "/dev/gpiochip7", .line = 1},
          .enable = {.kind = EnableKind::kGpio, .device = {}, .chip = {}, .line = 2, .closed_is_on = closed_is_on}};
}

struct GpioLines : ::testing::Test {
  GpioLines() { fake_gpio_chip() = {}; }
  FakeGpioChip& chip = fake_gpio_chip();

  static std::string refusal(const WatchdogSettings& settings) {
    try {
      const WatchdogLines lines = open_watchdog_lines(settings, "/");
    } catch (const InputError& e) {
      return e.what();
    }
    return "opened";
  }
};

TEST_F(GpioLines, ToggleWithEveryEdgeFromLowOn) {
  const WatchdogLines lines = open_watchdog_lines(both(), "/");
  EXPECT_TRUE(chip.lines[1].output);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(lines.heartbeat->edge().ok());
  EXPECT_THAT(chip.lines[1].written, ElementsAre(1, 0, 1, 0));
  chip.lines[1].fails = true;
  EXPECT_EQ(lines.heartbeat->edge().error().code, ErrorCode::kDisconnected);
}

TEST_F(GpioLines, ReadTheEnabledContactAndPullAwayFromIt) {
  for (const bool closed_is_on : {true, false}) {
    const WatchdogLines lines = open_watchdog_lines(both(closed_is_on), "/");
    EXPECT_FALSE(chip.lines[2].output);
    EXPECT_EQ(chip.lines[2].flags,
              closed_is_on ? GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN : GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP);
    for (const int level : {0, 1}) {
      chip.lines[2].level = level;
      EXPECT_EQ(lines.enable->read().value(), (level == 1) == closed_is_on);
    }
  }
  const WatchdogLines lines = open_watchdog_lines(both(), "/");
  chip.lines[2].fails = true;
  EXPECT_EQ(lines.enable->read().error().code, ErrorCode::kDisconnected);
}

TEST_F(GpioLines, AreGivenBack) {
  { const WatchdogLines lines = open_watchdog_lines(both(), "/"); }
  EXPECT_EQ(chip.open, 0);
  EXPECT_FALSE(chip.lines[1].requested);
}

TEST_F(GpioLines, ThatAreAbsentOrUsedAreRefusedInOneLineWithTheCure) {
  WatchdogSettings settings = both();
  settings.heartbeat.chip = "/dev/gpiochip9";
  EXPECT_EQ(
      refusal(settings),
      "safety: heartbeat_output: /dev/gpiochip9: No such file or directory, expected a GPIO chip: gpiodetect lists "
      "them");
  settings = both();
  settings.heartbeat.line = 4;
  EXPECT_EQ(refusal(settings), "safety: heartbeat_output: /dev/gpiochip7: found line 4, expected 0 to 3");
  settings = both();
  chip.lines[2].user = "lamp";
  EXPECT_EQ(refusal(settings),
            "safety: enable_input: /dev/gpiochip7: line 2: Device or resource busy, used by lamp, expected one that is "
            "free: gpioinfo lists them");
  EXPECT_EQ(chip.open, 0);
  settings.enable.line = 1;
  EXPECT_THAT(refusal(settings), HasSubstr("enable_input: /dev/gpiochip7: line 1: Device or resource busy"))
      << "the heartbeat's own";
  settings.heartbeat = {};
  EXPECT_THAT(refusal(settings), HasSubstr("enable_input: found gpio without a chip"));
}

}  // namespace
}  // namespace tankrig
