// Power cuts at random moments of a recording: of what was handed over a second before, the disk itself has all.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>
#include <thread>

#include "session/checking/session_recover.hpp"
#include "tests/session/disk_door.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;
using testing_support::DiskDoor;

constexpr auto kMostLost = 1s * testing_support::kSlowness;
constexpr auto kRecording = 2500ms + kMostLost;
constexpr auto kFramePeriod = 10ms;
constexpr int kCuts = 20;

TEST(PowerCut, LosesNothingOlderThanASecond) {
  constexpr unsigned kSeed = 1;
  constexpr Duration kBearable = 100ms * testing_support::kSlowness;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int> moments(0, static_cast<int>(kRecording / 1ms));
  std::vector<std::chrono::milliseconds> cuts(kCuts);
  for (auto& cut : cuts) cut = std::chrono::milliseconds(moments(random));
  std::sort(cuts.begin(), cuts.end());

  const InMemory in_memory;  // the disk's own speed is not the point
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "s";
  struct Cut {
    fs::path path;
    SteadyClock::time_point when;
  };
  std::vector<Cut> left;
  std::vector<SteadyClock::time_point> handed_over;
  testing_support::MachineWitness witness;
  {
    const DiskDoor door(folder.path());
    SessionInfo info = some_info();
    info.rig_hash.clear();
    SessionWriter writer(path, info, {.wait_when_full = false});
    writer.add_text("box.obj", "v 0 0 0\n");
    const auto begin = SteadyClock::now();
    for (int i = 0; SteadyClock::now() - begin < kRecording; ++i) {
      writer.joints(some_joints(i));
      writer.frame(some_frame(i), test_image(i));
      handed_over.push_back(SteadyClock::now());
      while (left.size() < cuts.size() && begin + cuts[left.size()] < SteadyClock::now()) {
        left.push_back({folder.path() / std::to_string(left.size()), SteadyClock::now()});
        leave_on_disk(door, path, left.back().path);
      }
      std::this_thread::sleep_until(SteadyClock::now() + kFramePeriod);
    }
    writer.close("complete");
  }
  const bool in_time = witness.latest() <= kBearable;
  std::size_t worst = 0, with_frames = 0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", cut " + std::to_string(i));
    const auto before = [&](auto when) {
      return static_cast<std::size_t>(std::lower_bound(handed_over.begin(), handed_over.end(), when) -
                                      handed_over.begin());
    };
    const std::size_t needed = in_time ? before(left[i].when - kMostLost) : 0;
    if (!fs::exists(left[i].path)) {
      EXPECT_EQ(needed, 0u);
      continue;
    }
    const SessionFindings found = examine_session(left[i].path, {});
    EXPECT_GE(found.frames.records.size(), needed);
    EXPECT_GE(found.joints.records.size(), needed);
    EXPECT_FALSE(found.whole());
    worst = std::max(worst, before(left[i].when) - std::min(before(left[i].when), found.frames.records.size()));
    if (needed == 0) continue;
    ++with_frames;
    EXPECT_TRUE(recover_session(left[i].path, {}).finished);
    EXPECT_TRUE(examine_session(left[i].path, {}).whole());
  }
  std::printf("%zu cuts, %zu of them with frames to lose; at most the last %zu frames lost, %.0f ms; seed %u\n",
              left.size(), with_frames, worst,
              1e3 * std::chrono::duration<double>(kFramePeriod).count() * static_cast<double>(worst), kSeed);
  TANKRIG_SKIP_IF_LATE(witness, kBearable);
  EXPECT_GT(with_frames, 0u);
}

/// As the wire's log, which others write beside the recording.
TEST(PowerCut, AfterTheEndLosesNothingThatOthersWroteIntoTheSession) {
  const InMemory in_memory;
  const TemporaryFolder folder;
  const DiskDoor door(folder.path());
  SessionWriter writer(folder.path() / "s", some_info());
  record(writer, 3);
  while (!door.on_disk(folder.path() / "s").contains("joints.csv")) std::this_thread::sleep_for(1ms);  // the first sync
  folder.write("s/can.log", "the wire\n");
  writer.close("complete", {{}, [] { return true; }});  // no pictures, whose sync would bring it there too
  EXPECT_EQ(door.on_disk(folder.path() / "s")["can.log"], "the wire\n");
}

}  // namespace
}  // namespace tankrig
