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

#include "rig/session/checksums.hpp"
#include "rig/session/session_recover.hpp"
#include "tests/session/in_child.hpp"
#include "tests/session/in_memory.hpp"
#include "tests/session/some_session.hpp"
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
constexpr std::int64_t kLastSecond_ns = testing_support::kSlowness * std::int64_t{1'000'000'000};
/// Frames go to their files at once, lines every 100 ms: so much may be missing on a machine with time for it.
constexpr std::int64_t kFramesUnhurried_ns = 100'000'000, kLinesUnhurried_ns = 250'000'000;

/// What a recorder has handed over, and when: in memory that outlives it.
struct Journal {
  std::atomic<int> frames{0}, joints{0};
  std::atomic<bool> sealed{false};
  std::atomic<std::int64_t> latest_ns{0};  ///< how late it came to its turn, at most
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
    const auto turn = begin + (i + 1) * kFramePeriod;
    std::this_thread::sleep_until(turn);
    journal.latest_ns = std::max(journal.latest_ns.load(), std::int64_t{(SteadyClock::now() - turn) / 1ns});
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

/// What a kill may cost: where recorders come late to their turns their threads do too, but a second is the promise.
std::int64_t may_be_lost_ns(SharedJournals& journals, std::int64_t unhurried_ns) {
  std::int64_t latest = 0;
  for (int i = 0; i < kRecorders; ++i) latest = std::max(latest, journals[i].latest_ns.load());
  return std::min(kLastSecond_ns, unhurried_ns + 3 * latest);
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

/// Ten recorders at once, each killed at a moment of its own between `from` and `to` after its start.
void kill_and_check(std::chrono::milliseconds from, std::chrono::milliseconds to) {
  const unsigned seed = std::random_device()();
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::int64_t> moments(std::chrono::nanoseconds(from).count(),
                                                      std::chrono::nanoseconds(to).count());
  int recording = 0, with_something = 0;
  std::int64_t most_lost = 0;
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
    const std::int64_t frames_lost = may_be_lost_ns(journals, kFramesUnhurried_ns);
    const std::int64_t lines_lost = may_be_lost_ns(journals, kLinesUnhurried_ns);
    most_lost = std::max(most_lost, lines_lost);
    const auto frames = [&](const auto& kill) {
      const Journal& journal = journals[kill.second];
      return handed_over_before(journal.frame_ns, journal.frames, kill.first - frames_lost);
    };
    const auto joints = [&](const auto& kill) {
      const Journal& journal = journals[kill.second];
      return handed_over_before(journal.joint_ns, journal.joints, kill.first - lines_lost);
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
  std::printf("%d of %d kills met a recording, %d had frames to lose; lines are due after %.0f ms at most; seed %u\n",
              recording, kRounds * kRecorders, with_something, 1e-6 * static_cast<double>(most_lost), seed);
  EXPECT_GT(2 * recording, kRounds * kRecorders) << "seed " << seed;
}

TEST(SessionKill, WhileItStartsLosesNothingOlderThanASecond) { kill_and_check(0ms, 400ms); }
TEST(SessionKill, WhileItRecordsLosesNothingOlderThanASecond) { kill_and_check(200ms, 1400ms); }
TEST(SessionKill, LateInARecordingLosesNothingOlderThanASecond) { kill_and_check(1200ms, 1500ms); }
TEST(SessionKill, WhileItWritesPicturesLosesNothingOlderThanASecond) { kill_and_check(1390ms, 1900ms); }

}  // namespace
}  // namespace tankrig
