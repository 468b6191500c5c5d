// can.log of a cross-process bus.
#include "drivers/can/can_recorder.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "core/input_error.hpp"
#include "drivers/can/can_log.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "tests/can/can_support.hpp"
#include "tests/support/held_thread.hpp"

namespace tankrig {
namespace {

using namespace can_test;

class CanRecorderTest : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  MonotonicClock clock;
  std::filesystem::path log = folder.path() / "can.log";
  sim::CanHubSettings hub_settings{folder.path() / "vcan7.sock", 1'000'000};

  CanSettings node_settings() const {
    CanSettings s;
    s.interface = "unix:" + hub_settings.path.string();
    s.reopen_period = std::chrono::milliseconds(1);
    return s;
  }
  std::unique_ptr<CanBus> node() { return open_can(node_settings(), clock); }
};

std::int64_t wall_now() {
  timespec t{};
  ::clock_gettime(CLOCK_REALTIME, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

TEST_F(CanRecorderTest, RecordsBothDirectionsWithWallClockStamps) {
  sim::CanHub hub(hub_settings);
  auto a = node(), b = node();
  const std::int64_t begin = wall_now();
  CanRecorder sut(node_settings(), log);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(send_all_the_same(*a, numbered(0x101, i)));
    ASSERT_TRUE(send_all_the_same(*b, numbered(0x102, i)));
    ASSERT_TRUE(next_frame(*a));
    ASSERT_TRUE(next_frame(*b));
  }
  hub.inject(raw_error(CAN_ERR_PROT, 2, CAN_ERR_PROT_STUFF));
  ASSERT_TRUE(send_raw(a->descriptor(), raw_frame(0x1ABCDEF | CAN_EFF_FLAG, {1})));
  ASSERT_TRUE(send_raw(a->descriptor(), raw_frame(0x7F0 | CAN_RTR_FLAG)));
  ASSERT_TRUE(eventually([&] { return hub.report().frames == 202; }));
  sut.stop();
  const CanLog read = read_can_log(log);
  ASSERT_EQ(read.entries.size(), 203u);
  EXPECT_EQ(read.cut_bytes, 0u);
  EXPECT_EQ(sut.counters().recorded, 203u);
  std::int64_t last = begin / 1000 * 1000;
  int errors = 0, extended = 0, remote = 0;
  std::uint32_t next[2] = {};
  for (const CanLogEntry& e : read.entries) {
    EXPECT_EQ(e.interface, "vcan7");
    EXPECT_GE(e.wall_ns, last);
    last = e.wall_ns;
    errors += (e.frame.can_id & CAN_ERR_FLAG) != 0;
    remote += (e.frame.can_id & CAN_RTR_FLAG) != 0;
    extended += (e.frame.can_id & CAN_EFF_FLAG) != 0;
    if (e.frame.can_id == 0x101 || e.frame.can_id == 0x102) {
      EXPECT_EQ(e.frame.data[0], next[e.frame.can_id & 1]++);
    }
  }
  EXPECT_LE(last, wall_now());
  EXPECT_EQ(errors, 1);
  EXPECT_EQ(extended, 1);
  EXPECT_EQ(remote, 1);
}

TEST_F(CanRecorderTest, WritesWithinASecondWithoutBeingStopped) {
  sim::CanHub hub(hub_settings);
  auto a = node(), b = node();
  CanRecorder sut(node_settings(), log);
  ASSERT_TRUE(a->try_send(frame_of(1, {2, 3})).ok());
  EXPECT_TRUE(eventually([&] { return folder.read("can.log").ends_with("vcan7 001#0203\n"); }));
}

TEST_F(CanRecorderTest, LeavesADiskThatHangsBehind) {
  ASSERT_EQ(::mkfifo(log.c_str(), 0600), 0);
  const OwnedDescriptor full(::open(log.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  const std::string block(4096, ' ');
  while (::write(full.get(), block.data(), block.size()) > 0) {
  }
  ASSERT_EQ(errno, EAGAIN) << "whoever writes now waits";
  sim::CanHub hub(hub_settings);
  auto a = node(), b = node();
  CanRecorder sut(node_settings(), log, std::chrono::milliseconds(100));
  ASSERT_TRUE(a->try_send(frame_of(1, {2, 3})).ok());
  ASSERT_TRUE(eventually([&] { return hub.report().frames == 1; }));
  sut.stop();
  EXPECT_EQ(sut.counters().recorded, 0u);
  EXPECT_EQ(sut.counters().write_errors, 1u);
  EXPECT_EQ(sut.counters().disk_errno, ETIMEDOUT);
  std::string read(1 << 20, '\0');
  EXPECT_TRUE(eventually([&] {
    (void)!::read(full.get(), read.data(), read.size());
    return sut.counters().recorded == 1;
  })) << "it goes on by itself where the disk comes back";
}

TEST_F(CanRecorderTest, TakesAllThatWasReceivedBeforeItEnds) {
  constexpr int kFrames = 400;
  sim::CanHub hub(hub_settings);
  auto a = node(), b = node();
  CanRecorder sut(node_settings(), log, std::chrono::milliseconds(10));
  {
    const testing_support::HeldThread held("can-log");
    ASSERT_TRUE(held.found());
    for (int i = 0; i < kFrames; ++i) {
      ASSERT_TRUE(send_all_the_same(*a, numbered(0x101, i)));
      ASSERT_TRUE(next_frame(*b));
    }
    sut.stop();  // tells it to end, and waits in vain
    ASSERT_LT(sut.counters().recorded, static_cast<std::uint64_t>(kFrames));
  }
  EXPECT_TRUE(eventually([&] { return sut.counters().recorded == kFrames; })) << sut.counters().recorded;
}

TEST_F(CanRecorderTest, KilledProcessLeavesAReadableLog) {
  const pid_t child = ::fork();
  if (child == 0) {
    std::optional<CanRecorder> sut;
    eventually([&] { return message_of<InputError>([&] { sut.emplace(node_settings(), log); }) == "no error"; });
    ::pause();
    ::_exit(0);
  }
  sim::CanHub hub(hub_settings);
  auto a = node(), b = node();
  ASSERT_TRUE(eventually([&] { return hub.report().nodes.size() == 3; }));
  std::uint32_t sent = 0;
  ASSERT_TRUE(eventually([&] {
    if (a->try_send(numbered(1, sent)).ok()) ++sent;
    digest(*b);
    return std::filesystem::exists(log) && !read_can_log(log).entries.empty();
  }));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ASSERT_TRUE(eventually([&] { return hub.report().nodes.size() == 2; }));
  const std::size_t survived = read_can_log(log).entries.size();  // the kill may have cut a line: that is no error
  EXPECT_GT(survived, 0u);
  // As if it had: whoever goes on writes behind the last whole line.
  std::ofstream(log, std::ios::app) << "(1795267055.09";
  {
    CanRecorder again(node_settings(), log);
    ASSERT_TRUE(eventually([&] { return hub.report().nodes.size() == 3; }));
    ASSERT_TRUE(send_all_the_same(*a, frame_of(0x333)));
    ASSERT_TRUE(eventually([&] { return hub.report().frames == sent + 1; }));
  }
  const CanLog read = read_can_log(log);
  EXPECT_EQ(read.cut_bytes, 0u);
  EXPECT_GT(read.entries.size(), survived);
  EXPECT_EQ(read.entries.back().frame.can_id, 0x333u);
}

TEST_F(CanRecorderTest, FullDiskIsCountedAndNeverFatal) {
  // A limit on the size of files stands in for the disk; its signal must not end us, so it is all in a process of its
  // own.
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    bool good = false;
    {
      sim::CanHub hub(hub_settings);
      MonotonicClock time;
      auto a = open_can(node_settings(), time), b = open_can(node_settings(), time);
      CanRecorder sut(node_settings(), log);
      for (int i = 0; i < 100; ++i) good = send_all_the_same(*a, numbered(1, i)) && next_frame(*b);
      good = good && eventually([&] { return sut.counters().write_errors > 0; });
      const rlimit room{RLIM_INFINITY, RLIM_INFINITY};
      ::setrlimit(RLIMIT_FSIZE, &room);
      good = good && eventually([&] { return sut.counters().recorded == 100; });
      good = good && sut.counters().disk_errno == EFBIG && sut.counters().lost_to_disk == 0;
    }
    ::_exit(good ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  const CanLog read = read_can_log(log);
  ASSERT_EQ(read.entries.size(), 100u) << "what waited in memory is written when there is room again";
  for (int i = 0; i < 100; ++i) EXPECT_EQ(read.entries[i].frame.data[0], i);
}

TEST_F(CanRecorderTest, DiskThatStaysFullLosesFramesWithACount) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "/dev/full does not exist";
  sim::CanHub hub(hub_settings);
  auto a = node(), b = node();
  CanRecorder sut(node_settings(), "/dev/full");
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(send_all_the_same(*a, numbered(1, i)));
    ASSERT_TRUE(next_frame(*b));
  }
  ASSERT_TRUE(eventually([&] { return hub.report().frames == 50; }));
  sut.stop();
  EXPECT_EQ(sut.counters().recorded, 0u);
  EXPECT_EQ(sut.counters().lost_to_disk, 50u);
  EXPECT_GT(sut.counters().write_errors, 0u);
  EXPECT_EQ(sut.counters().disk_errno, ENOSPC);
}

TEST_F(CanRecorderTest, WaitsForABusThatIsStartedAgain) {
  auto hub = std::make_unique<sim::CanHub>(hub_settings);
  CanRecorder sut(node_settings(), log);
  hub = nullptr;
  hub = std::make_unique<sim::CanHub>(hub_settings);
  ASSERT_TRUE(eventually([&] { return sut.counters().reopened == 1; }));
  auto a = node(), b = node();
  ASSERT_TRUE(a->try_send(frame_of(0x55)).ok());
  ASSERT_TRUE(eventually([&] { return hub->report().frames == 1; }));
  sut.stop();
  EXPECT_EQ(read_can_log(log).entries.size(), 1u);
}

TEST_F(CanRecorderTest, OpeningErrorsNameTheFileOrTheBus) {
  EXPECT_NE(message_of<InputError>([&] { CanRecorder sut(node_settings(), log); }).find("no CAN bus there"),
            std::string::npos);
  sim::CanHub hub(hub_settings);
  EXPECT_NE(message_of<InputError>([&] {
              CanRecorder sut(node_settings(), folder.path() / "no" / "can.log");
            }).find("cannot write the CAN log: No such file"),
            std::string::npos);
}

TEST_F(CanRecorderTest, StopsPromptlyThoughTheBusIsGone) {
  auto hub = std::make_unique<sim::CanHub>(hub_settings);
  const auto begin = std::chrono::steady_clock::now();
  {
    CanRecorder sut(node_settings(), log);
    hub.reset();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

}  // namespace
}  // namespace tankrig
