// The arm driver against can-utils: an arm made of hand-written frames, sent by cansend and canplayer.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <stdexcept>

#include "drivers/arm/arm5e.hpp"
#include "tests/kernel/guest.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::test {
namespace {

using std::chrono::seconds;

/// Time enough for a program to start between a request and its answer.
Arm5eSettings patient_arm() {
  Arm5eSettings settings;
  settings.can.interface = "vcan0";
  settings.can.bitrate = 1'000'000;
  settings.can.filters = settings.can_ids.arm_filters();
  settings.reply_timeout = settings.silence_timeout = settings.watchdog = seconds(60);
  return settings;
}

// One whole answer: master's bytes, then the joints' sensors. Positions 0x0102, 0x0304, 0x0506, 0xFFFE, 0x0009.
constexpr const char* kAnswer =
    "(0.000000) vcan0 180#649632\n"
    "(0.000100) vcan0 181#0201000000400000\n"
    "(0.000200) vcan0 182#0403000000410000\n"
    "(0.000300) vcan0 183#0605000000420000\n"
    "(0.000400) vcan0 184#FEFF000000430000\n"
    "(0.000500) vcan0 185#0900000000440000\n";

double count(const Arm5e& arm, const std::string& name) {
  for (const Statistic& s : arm.statistics())
    if (s.name == name) return s.value;
  throw std::runtime_error("no statistic " + name);
}

/// A state the driver makes of answers to its requests, one each; nothing after eight.
std::optional<JointState> state_of(Arm5e& arm, const std::function<void()>& answer) {
  constexpr double kFrames = kJoints;  // of a request
  std::optional<JointState> state;
  const auto asks = [&] {
    const auto read = arm.try_read();
    if (read.ok() && read.value()) state = read.value();
    return state || count(arm, "can_sent") == kFrames * (count(arm, "exchanges") + 1);
  };
  for (int i = 0; i < 8 && !state && becomes_true(asks); ++i) {
    if (state) break;
    const double before = count(arm, "exchanges");
    answer();
    becomes_true([&] { return asks(), count(arm, "exchanges") > before; });
  }
  return state;
}

TEST(ArmOnVcanWithCanUtils, AHandWrittenAnswerBecomesAJointState) {
  const TemporaryFolder folder;
  const auto log = folder.write("answer.log", kAnswer);
  MonotonicClock clock;
  const auto arm = open_arm5e(patient_arm(), arm5e(), clock);
  auto state = state_of(*arm, [&] { shell("canplayer -t -I " + log.string()); });
  ASSERT_TRUE(state);
  EXPECT_EQ(state->ticks, (std::array<std::int32_t, kJoints>{0x0102, 0x0304, 0x0506, -2, 9}));
  const ArmScaling scaling = laboratory_scaling();
  EXPECT_DOUBLE_EQ(state->current_a, scaling.amperes(0x32));
  EXPECT_DOUBLE_EQ(arm->readings().voltage_v, scaling.volts(0x96));
  EXPECT_DOUBLE_EQ(arm->readings().master_temperature_c, scaling.celsius(0x64));
  EXPECT_DOUBLE_EQ(arm->readings().temperature_c[kElbow], scaling.celsius(0x42));

  // The same by cansend, frame by frame; the elbow 17 ticks on.
  state = state_of(*arm, [] {
    for (const char* frame : {"180#649632", "181#0201000000400000", "182#0403000000410000", "183#1705000000420000",
                              "184#FEFF000000430000", "185#0900000000440000"})
      shell(std::string("cansend vcan0 ") + frame);
  });
  ASSERT_TRUE(state);
  EXPECT_EQ(state->ticks[kElbow], 0x0517);
}

TEST(ArmOnVcanWithCanUtils, CandumpSeesTheGainsAndTheDemandsByteForByte) {
  const TemporaryFolder folder;
  const std::string log = (folder.path() / "candump.log").string();
  Background candump({"candump", "-L", "-n", "10", "vcan0,200:7E0"}, log);
  ASSERT_TRUE(becomes_true([] { return shell("cat /proc/net/can/rcvlist_fil").find("vcan0") != std::string::npos; }));
  MonotonicClock clock;
  const Arm5eSettings settings = patient_arm();
  const auto arm = std::make_unique<Arm5e>(
      settings, arm5e(),
      std::make_unique<CanArmLink>(open_can(settings.can, clock), settings.can_ids, settings.can.bitrate), clock);
  ASSERT_TRUE(drive_ticks(*arm, {0, 0x0123, -0x010A, 0, 0}).ok());  // the gains go first
  ASSERT_TRUE(becomes_true([&] { return shell("cat " + log).find("215#") != std::string::npos; }));
  const auto acknowledged =
      folder.write("gains.log",
                   "(0.000000) vcan0 191#0000000000000000\n(0.000000) vcan0 192#0000000000000000\n"
                   "(0.000000) vcan0 193#0000000000000000\n(0.000000) vcan0 194#0000000000000000\n"
                   "(0.000000) vcan0 195#0000000000000000\n");
  shell("canplayer -t -I " + acknowledged.string());
  ASSERT_TRUE(becomes_true([&] {
    (void)arm->try_read();
    (void)drive_ticks(*arm, {0, 0x0123, -0x010A, 0, 0});
    return shell("cat " + log).find("205#") != std::string::npos;
  }));
  ASSERT_EQ(candump.wait(), 0);
  std::string frames = shell("cut -d' ' -f3 " + log);
  std::replace(frames.begin(), frames.end(), '\n', ' ');
  // Speed forward 3, backward 4; a low byte of 0x0A is raised by one; the jaw's current limit is its own.
  EXPECT_EQ(frames,
            "211#000000FF04000000 212#000000FF04000000 213#000000FF04000000 214#000000FF04000000 "
            "215#000000FF04000000 201#0000000FFF0FFF00 202#0301230FFF0FFF00 203#04010B0FFF0FFF00 "
            "204#0000000FFF0FFF00 205#0000000FFF00FF00 ");
}

}  // namespace
}  // namespace tankrig::test
