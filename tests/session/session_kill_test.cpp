// Recording processes killed at random moments: what was handed over a second before is there, and check is right.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "session/checking/checksums.hpp"
#include "session/checking/session_recover.hpp"
#include "tests/session/in_child.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

constexpr int kRecorders = 10, kRounds = 5;  // of each of the four cases below: 200 kills
constexpr int kMaxFrames = 4096, kJointsPerFrame = 4;
constexpr auto kFramePeriod = 5ms;
constexpr auto kRecording = 1400ms;
constexpr Duration kBearable = 50ms * testing_support::kSlowness;
/// Frames go to their files at once, lines every 100 ms: older ones may not be missing where each of the three threads
/// on their way is at most kBearable late. A second is the promise.
constexpr std::int64_t kFramesDue_ns = testing_support::kSlowness * std::int64_t{250'000'000};
constexpr std::int64_t kLinesDue_ns = testing_support::kSlowness * std::int64_t{400'000'000};

/// What a recorder has handed over, and when: in memory that outlives it.
struct Journal {
  std::atomic<int> frames{0}, joints{0};
  std::atomic<bool> sealed{false};
  std::array<std::atomic<std::int64_t>, kMaxFrames> frame_ns{};
  std::array<std::atomic<std::int64_t>, kMaxFrames * kJointsPerFrame> joint_ns{};
};

std::int64_t now_ns() { return std::chrono::nanoseconds(SteadyClock::now().time_since_epoch()).count(); }

class SharedJournals {
 public:
  SharedJournals() {
    memory_ = ::mmap(nullptr, sizeof(Journal) * kRecorders, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory_ == MAP_FAILED) throw std::runtime_error("no shared memory");
    for (int i = 0; i < kRecorders; ++i) new (&(*this)[i]) Journal;
  }
  ~SharedJournals() { ::munmap(memory_, sizeof(Journal) * kRecorders); }
  Journal& operator[](int i) { return static_cast<Journal*>(memory_)[i]; }

 private:
  void* memory_;
};

/// Records in real time until it is done or dead, then makes pictures and seals.
void record_in_real_time(const fs::path& path, Journal& journal) {
  SessionInfo info = some_info();
  info.rig_hash.clear();
  SessionWriter writer(path, info, {.wait_when_full = false});
  writer.add_text("box.obj", "v 0 0 0\n");
  const auto begin = SteadyClock::now();
  for (int i = 0; i < kMaxFrames && SteadyClock::now() - begin < kRecording; ++i) {
    for (int j = 0; j < kJointsPerFrame; ++j) {
      writer.joints(some_joints(i * kJointsPerFrame + j));
      journal.joint_ns[static_cast<std::size_t>(journal.joints)] = now_ns();
      ++journal.joints;
    }
    writer.frame(some_frame(i), test_image(i));
    journal.frame_ns[static_cast<std::size_t>(i)] = now_ns();
    ++journal.frames;
    std::this_thread::sleep_until(begin + (i + 1) * kFramePeriod);
  }
  writer.close("complete");
  write_checksums(path);
  journal.sealed = true;
}

template <std::size_t N>
int handed_over_before(const std::array<std::atomic<std::int64_t>, N>& times, int count, std::int64_t when) {
  int n = 0;
  while (n < count && times[static_cast<std::size_t>(n)] < when) ++n;
  return n;
}

/// One session a kill left, and how much of what was handed over must be in it.
void check_what_is_left(const fs::path& path, const Journal& journal, int frames, int joints) {
  if (!fs::exists(path)) {
    EXPECT_EQ(frames + joints, 0);
    return;
  }
  const SessionFindings found = examine_session(path, {});
  ASSERT_GE(found.frames.records.size(), static_cast<std::size_t>(frames));
  ASSERT_GE(found.joints.records.size(), static_cast<std::size_t>(joints));
  EXPECT_LE(found.frames.records.size(), static_cast<std::size_t>(journal.frames) + 1);
  EXPECT_TRUE(found.whole() || !journal.sealed);
  EXPECT_TRUE(!found.whole() || fs::exists(path / "SHA256SUMS"));
  for (std::size_t i = 0; i < found.frames.records.size(); ++i)
    ASSERT_EQ(found.frames.records[i].index, static_cast<int>(i)) << "none missing before the end";
  for (std::size_t i = 0; i < found.joints.records.size(); ++i)
    ASSERT_EQ(found.joints.records[i].stamp, some_joints(static_cast<int>(i)).stamp);
  const Recovery done = recover_session(path, {});
  EXPECT_EQ(done.finished, found.usable() || found.whole());
  if (!done.finished) {
    EXPECT_EQ(frames + joints, 0) << "nothing usable, though there was something";
    return;
  }
  EXPECT_TRUE(examine_session(path, {}).whole());
  const Session session = Session::open(path);
  EXPECT_THAT(session.warnings, testing::IsEmpty());
  ASSERT_EQ(session.frames.size(), found.frames.records.size());
  for (const FrameRecord& frame : session.frames)
    ASSERT_EQ(cv::norm(session.image(frame), test_image(frame.index), cv::NORM_INF), 0);
}

/// The machine, over all rounds.
struct Lateness {
  Duration most{};
  Duration latest() const { return most; }
};

/// Ten recorders at once, each killed at a moment of its own between `from` and `to` after its start. What is left is
/// consistent on every machine; how much it is, on one that kept time.
void kill_and_check(std::chrono::milliseconds from, std::chrono::milliseconds to, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::int64_t> moments(std::chrono::nanoseconds(from).count(),
                                                      std::chrono::nanoseconds(to).count());
  int recording = 0, with_something = 0;
  Lateness machine;
  for (int round = 0; round < kRounds && !testing::Test::HasFailure(); ++round) {
    const InMemory in_memory;
    const TemporaryFolder folder;
    SharedJournals journals;
    const auto path = [&](int i) { return folder.path() / std::to_string(i); };
    std::array<pid_t, kRecorders> children{};
    std::vector<std::pair<std::int64_t, int>> kills;
    for (int i = 0; i < kRecorders; ++i) {
      children[static_cast<std::size_t>(i)] = start_child([&] { record_in_real_time(path(i), journals[i]); });
      kills.emplace_back(now_ns() + moments(random), i);
    }
    std::sort(kills.begin(), kills.end());
    testing_support::MachineWitness witness;
    for (auto& [when, i] : kills) {
      std::this_thread::sleep_until(SteadyClock::time_point(std::chrono::nanoseconds(when)));
      when = now_ns();
      ::kill(children[static_cast<std::size_t>(i)], SIGKILL);
    }
    for (int i = 0; i < kRecorders; ++i) {
      const int status = wait_for_child(children[static_cast<std::size_t>(i)]);
      const bool killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
      EXPECT_TRUE(killed || (WIFEXITED(status) && WEXITSTATUS(status) == 0 && journals[i].sealed))
          << "status " << status << ", seed " << seed;
      recording += journals[i].frames > 0;
    }
    const Duration late = witness.latest();
    (void)witness.lateness();  // ends its threads: children are made of this process
    machine.most = std::max(machine.most, late);
    const bool in_time = late <= kBearable;
    const auto frames = [&](const auto& kill) {
      const Journal& journal = journals[kill.second];
      return in_time ? handed_over_before(journal.frame_ns, journal.frames, kill.first - kFramesDue_ns) : 0;
    };
    const auto joints = [&](const auto& kill) {
      const Journal& journal = journals[kill.second];
      return in_time ? handed_over_before(journal.joint_ns, journal.joints, kill.first - kLinesDue_ns) : 0;
    };
    for (const auto& kill : kills) with_something += frames(kill) > 0;
    in_child([&] {
      for (const auto& kill : kills) {
        SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round) + ", recorder " +
                     std::to_string(kill.second));
        check_what_is_left(path(kill.second), journals[kill.second], frames(kill), joints(kill));
      }
    });
  }
  std::printf("%d of %d kills met a recording, %d had frames to lose; machine late by %.1f ms at most; seed %u\n",
              recording, kRounds * kRecorders, with_something, 1e3 * seconds(machine.most), seed);
  TANKRIG_SKIP_IF_LATE(machine, kBearable);
  EXPECT_GT(2 * recording, kRounds * kRecorders) << "seed " << seed;
}

TEST(SessionKill, WhileItStartsLosesNothingOlderThanASecond) { kill_and_check(0ms, 400ms, 1); }
TEST(SessionKill, WhileItRecordsLosesNothingOlderThanASecond) { kill_and_check(200ms, 1400ms, 2); }
TEST(SessionKill, LateInARecordingLosesNothingOlderThanASecond) { kill_and_check(1200ms, 1500ms, 3); }
TEST(SessionKill, WhileItWritesPicturesLosesNothingOlderThanASecond) { kill_and_check(1390ms, 1900ms, 4); }

}  // namespace
}  // namespace tankrig
