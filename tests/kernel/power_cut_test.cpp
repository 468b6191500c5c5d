// The two ends of a power cut: a recording that runs until QEMU is killed, and what the next guest finds on its disk.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <sstream>
#include <thread>
#include <vector>

#include "session/checking/checksums.hpp"
#include "session/checking/session_recover.hpp"
#include "tests/session/some_session.hpp"
#include "tests/support/machine_witness.hpp"

namespace tankrig::test {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

constexpr auto kFramePeriod = 20ms;
constexpr int kJointsPerFrame = 4, kEndedFrames = 50;
constexpr Duration kBearable = 100ms;  // each thread on the way to the disk as late: a second is still enough
constexpr int kMostHeld_ms = 250;      // of a caller, by a recorder that waits for no disk

std::string from_script(const char* name) {
  const char* value = std::getenv(name);
  if (!value) throw std::runtime_error(std::string(name) + " is not set: tests/kernel/power_cut.sh sets it");
  return value;
}

int in_ms(SteadyClock::duration time) {
  return static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

void expect_pictures(const std::filesystem::path& session, std::size_t frames) {
  const Session whole = Session::open(session);
  EXPECT_EQ(whole.frames.size(), frames);
  for (const FrameRecord& frame : whole.frames)
    ASSERT_EQ(cv::norm(whole.image(frame), test_image(frame.index), cv::NORM_INF), 0);
}

TEST(CutRecording, EndsAndIsSealed) {
  SessionWriter writer(from_script("CUT_SESSION"), bare_info());
  record(writer, kEndedFrames);
  writer.close("complete");
  write_checksums(writer.path());
}

TEST(CutRecording, IsWholeIfItHadEnded) {
  const std::filesystem::path session = from_script("CUT_SESSION");
  const SessionFindings found = examine_session(session, {});
  for (const std::string& loss : found.losses) ADD_FAILURE() << "lost: " << loss;
  for (const std::string& undone : found.undone) ADD_FAILURE() << "not finished: " << undone;
  expect_pictures(session, kEndedFrames);
}

/// Says what was handed over, when, and how long that held it at most: what was said is known to the host, whatever
/// becomes of the guest. Says too if the machine was late, whoever it was that waited.
TEST(CutRecording, RunsUntilTheSupplyGoes) {
  const auto cut = std::chrono::duration<double>(std::stod(from_script("CUT_AFTER_S")));
  SessionWriter writer(from_script("CUT_SESSION"), bare_info(), {.wait_when_full = false});
  const testing_support::MachineWitness witness;
  const auto begin = SteadyClock::now();
  SteadyClock::duration held{};
  bool told = false;
  for (int i = 0; SteadyClock::now() - begin < 60s; ++i) {
    const auto before = SteadyClock::now();
    for (int j = 0; j < kJointsPerFrame; ++j) writer.joints(some_joints(i * kJointsPerFrame + j));
    writer.frame(some_frame(i), test_image(i));
    const auto now = SteadyClock::now();
    held = std::max(held, now - before);
    std::printf("handed over frames=%d at_ms=%d held_ms=%d\n", i + 1, in_ms(now - begin), in_ms(held));
    if (const Duration late = witness.latest(); late > kBearable)
      std::printf("%s\n", testing_support::machine_was_late(late, kBearable).c_str());
    if (!told && now - begin > cut) told = std::printf("now\n") > 0;
    std::fflush(stdout);
    std::this_thread::sleep_until(begin + (i + 1) * kFramePeriod);
  }
  FAIL() << "the supply did not go";
}

TEST(CutRecording, LostAtMostItsLastSecond) {
  struct Said {
    int frames = 0, at_ms = 0, held_ms = 0;
  };
  std::vector<Said> said;
  std::istringstream lines(from_script("CUT_HANDED_OVER"));
  for (std::string line; std::getline(lines, line);) {
    Said s;
    ASSERT_EQ(std::sscanf(line.c_str(), "handed over frames=%d at_ms=%d held_ms=%d", &s.frames, &s.at_ms, &s.held_ms),
              3)
        << line;
    said.push_back(s);
  }
  ASSERT_FALSE(said.empty());
  std::size_t needed = 0;
  if (from_script("CUT_WAS_LATE").empty()) {
    EXPECT_LE(said.back().held_ms, kMostHeld_ms) << "the recorder held its caller";
    for (const Said& s : said)
      if (s.at_ms <= said.back().at_ms - 1000) needed = static_cast<std::size_t>(s.frames);
    ASSERT_GT(needed, 20u) << "cut too early to show anything";
  }

  const std::filesystem::path session = from_script("CUT_SESSION");
  const SessionFindings found = examine_session(session, {});
  std::printf("%d frames handed over, %zu there, %zu needed; a caller held for %d ms at most\n", said.back().frames,
              found.frames.records.size(), needed, said.back().held_ms);
  EXPECT_GE(found.frames.records.size(), needed);
  EXPECT_GE(found.joints.records.size(), needed * kJointsPerFrame);
  EXPECT_FALSE(found.whole());
  EXPECT_EQ(recover_session(session, {}).finished, found.usable());
  if (!found.usable()) {
    EXPECT_EQ(needed, 0u);
    return;
  }
  EXPECT_TRUE(examine_session(session, {}).whole());
  expect_pictures(session, found.frames.records.size());
}

}  // namespace
}  // namespace tankrig::test
