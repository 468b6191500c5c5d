// A watchdog box that is enabled before its first edge.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "core/input_error.hpp"
#include "drivers/watchdog/box_frames.hpp"
#include "rig/scan/before_start.hpp"
#include "sim_backends/wire/box_emulator.hpp"
#include "sim_backends/wire/pty_server.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct BoxOnALine {
  TemporaryFolder folder;
  std::filesystem::path line = folder.path() / "box";
  MonotonicClock clock;
  SafetySettings settings;
  BoxOnALine() {
    settings.heartbeat_output = {.kind = HeartbeatKind::kBytes, .device = line};
    settings.enable_input.kind = EnableKind::kReply;
  }
  WatchdogSettings box() const { return {settings.heartbeat_output, settings.enable_input}; }
};

TEST(ABoxBeforeAStart, ThatTheLastCommandLeftEnabledIsWaitedFor) {
  BoxOnALine bench;
  sim::BoxEmulator emulator({.name = bench.line, .reset_after = 50ms}, [](bool) {});
  WatchdogBox box(bench.box(), "/", bench.clock);
  for (const Stamp end = bench.clock.now() + 10s; !box.enabled(bench.clock.now()) && bench.clock.now() < end;) {
    BenchRight::complete(box);
    bench.clock.sleep_until(bench.clock.now() + 5ms);
  }
  ASSERT_TRUE(emulator.closed());
  check_box_open(bench.settings, box, bench.clock);
  EXPECT_FALSE(box.enabled(bench.clock.now()));
}

TEST(ABoxBeforeAStart, ThatIsEnabledThoughNothingBeatsIsRefused) {
  BoxOnALine bench;
  std::atomic<sim::PtyServer*> line = nullptr;
  sim::PtyServer bridged(
      bench.line, [](std::span<const std::uint8_t>) {},
      [&line] {
        if (sim::PtyServer* const it = line) it->answer(encode_box(kReplyLead, {kBoxEnabled, 0}));
        return Duration(5ms);
      });
  line = &bridged;
  const WatchdogBox box(bench.box(), "/", bench.clock);
  try {
    check_box_open(bench.settings, box, bench.clock);
    FAIL() << "it was let through";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("the watchdog box is enabled though it gets no heartbeat"));
  }
  line = nullptr;
}

}  // namespace
}  // namespace tankrig
