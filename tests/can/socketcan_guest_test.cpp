// Real SocketCAN: virtual interfaces of our own, and the two emulated controllers of the kernel tests' guest.
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <thread>

#include "core/input_error.hpp"
#include "drivers/can/can_link.hpp"
#include "drivers/can/can_log.hpp"
#include "drivers/can/can_recorder.hpp"
#include "drivers/can/can_timing.hpp"
#include "tests/can/can_support.hpp"

namespace tankrig {
namespace {

using namespace can_test;

bool run(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }
bool installed(const std::string& program) { return run("command -v " + program); }

/// A program that runs until it is told to end.
class Program {
 public:
  Program(const std::vector<std::string>& words, const std::filesystem::path& output) {
    pid_ = ::fork();
    if (pid_ != 0) return;
    if (!std::freopen(output.c_str(), "w", stdout)) ::_exit(126);
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  ~Program() { end(SIGKILL); }
  void end(int signal) {
    if (pid_ <= 0) return;
    ::kill(pid_, signal);
    ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_ = 0;
};

/// A socket of the test's own, beside the driver's.
class RawSocket {
 public:
  explicit RawSocket(const std::string& interface) : fd_(::socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~RawSocket() { ::close(fd_); }
  void send(const can_frame& f) const { ASSERT_TRUE(send_raw(fd_, f)); }

 private:
  int fd_;
};

class SocketCan : public ::testing::Test {
 protected:
  MonotonicClock clock;
  TemporaryFolder folder;
  std::string name = "vt" + std::to_string(::getpid());  ///< a virtual interface of this test's own

  void SetUp() override {
    const int fd = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (fd < 0) GTEST_SKIP() << "no CAN sockets in this kernel: " << std::strerror(errno);
    ::close(fd);
    if (!add()) GTEST_SKIP() << "cannot add a virtual CAN interface (needs root and the vcan module)";
  }
  void TearDown() override { remove(); }

  bool add() const { return run("ip link add " + name + " type vcan && ip link set " + name + " up"); }
  bool remove() const { return run("ip link del " + name); }

  CanSettings settings() const {
    CanSettings s;
    s.interface = name;
    s.reopen_period = std::chrono::milliseconds(1);
    return s;
  }
  std::unique_ptr<CanBus> open() const { return open_can(settings(), clock); }
  std::string opening(const std::string& interface) const {
    CanSettings s;
    s.interface = interface;
    return message_of<InputError>([&] { open_can(s, clock); });
  }
};

TEST_F(SocketCan, KernelFiltersAndStampsFrames) {
  CanSettings s = settings();
  s.filters = {{0x120, 0x7F0}};
  auto sut = open_can(s, clock);
  const RawSocket peer(name);
  const Stamp before = clock.now();
  peer.send(raw_frame(0x11F));
  peer.send(raw_frame(0x12A, {1, 2, 3}));
  peer.send(raw_frame(0x12A | CAN_RTR_FLAG));
  peer.send(raw_frame(0x12A | CAN_EFF_FLAG));
  const Stamp after = clock.now();
  clock.sleep_until(after + std::chrono::milliseconds(30));  // a stamp of the reader's would show it
  const auto f = sut->try_receive().value();
  ASSERT_TRUE(f);
  EXPECT_EQ(f->id, 0x12A);
  EXPECT_EQ(f->length, 3);
  EXPECT_GE(f->stamp, before - std::chrono::microseconds(100));
  EXPECT_LE(f->stamp, after + std::chrono::milliseconds(5));
  EXPECT_FALSE(sut->try_receive().value());
  EXPECT_EQ(sut->counters().foreign, 0u) << "the kernel kept the others away";
}

TEST_F(SocketCan, FramesPassBothWaysInOrder) {
  auto a = open(), b = open();
  for (std::uint32_t i = 0; i < 500; ++i) {
    ASSERT_TRUE(send_all_the_same(*a, numbered(1, i)));
    ASSERT_TRUE(send_all_the_same(*b, numbered(2, i)));
  }
  Stamp last_a{}, last_b{};
  for (std::uint32_t i = 0; i < 500; ++i) {
    const auto at_b = next_frame(*b), at_a = next_frame(*a);
    ASSERT_TRUE(at_a && at_b);
    ASSERT_EQ(number_of(*at_b), i);
    ASSERT_EQ(number_of(*at_a), i);
    ASSERT_GE(at_a->stamp, last_a);
    ASSERT_GE(at_b->stamp, last_b);
    last_a = at_a->stamp;
    last_b = at_b->stamp;
  }
}

TEST_F(SocketCan, OpeningErrorsSayWhatToDo) {
  EXPECT_EQ(opening("nocan7"),
            "nocan7 does not exist: plug the adapter in, or for a virtual bus: ip link add nocan7 type vcan");
  EXPECT_NE(opening("lo").find("lo is not a CAN interface"), std::string::npos);
  ASSERT_TRUE(run("ip link set " + name + " down"));
  EXPECT_NE(opening(name).find(name + " is down: ip link set " + name + " up"), std::string::npos) << opening(name);
}

TEST_F(SocketCan, ControllerAtAnotherBitRateIsRefusedWhereTheRigFileSaysOne) {
  const auto link = read_can_link("can0");
  if (!link || !link->bitrate) GTEST_SKIP() << "no controller can0";
  EXPECT_EQ(link->kind, "can");
  CanSettings s;
  s.interface = "can0";
  s.bitrate = *link->bitrate;
  s.check_bitrate = true;
  EXPECT_EQ(message_of<InputError>([&] { open_can(s, clock); }), "no error");
  s.bitrate = *link->bitrate / 2;
  const std::string rate = std::to_string(s.bitrate);
  EXPECT_EQ(message_of<InputError>([&] { open_can(s, clock); }),
            "can0 runs at " + std::to_string(*link->bitrate) + " bit/s, expected " + rate +
                ": ip link set can0 down && ip link set can0 up type can bitrate " + rate);
  s.interface = name;
  EXPECT_EQ(message_of<InputError>([&] { open_can(s, clock); }), "no error") << "a virtual one has no bit rate";
  EXPECT_EQ(read_can_link(name)->kind, "vcan");
  EXPECT_FALSE(read_can_link("nocan7"));
}

TEST_F(SocketCan, ListeningControllerIsRefusedForANode) {
  if (!run("ip link set can1 down && ip link set can1 up type can bitrate 1000000 listen-only on"))
    GTEST_SKIP() << "no controller can1 that can only listen";
  EXPECT_NE(opening("can1").find("can1 only listens and cannot send: ip link set can1 down"), std::string::npos);
  CanSettings s;
  s.interface = "can1";
  EXPECT_EQ(message_of<InputError>([&] { CanRecorder listener(s, folder.path() / "can.log"); }), "no error");
  EXPECT_TRUE(run("ip link set can1 down && ip link set can1 up type can bitrate 1000000 listen-only off"));
}

TEST_F(SocketCan, InjectedErrorFramesBecomeStates) {
  auto sut = open();
  const RawSocket peer(name);
  const auto state_after = [&](const can_frame& f) {
    peer.send(f);
    const auto before = sut->counters().error_frames;
    EXPECT_TRUE(eventually([&] { return digest(*sut), sut->counters().error_frames > before; }));
    return sut->state();
  };
  EXPECT_EQ(state_after(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_WARNING)), CanState::kErrorWarning);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_PASSIVE)), CanState::kErrorPassive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_ACK)), CanState::kErrorPassive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_BUSOFF)), CanState::kBusOff);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_RESTARTED)), CanState::kErrorActive);
  EXPECT_EQ(sut->counters().no_ack, 1u);
  EXPECT_EQ(sut->counters().bus_off, 1u);
}

TEST_F(SocketCan, ReceiveOverflowIsCountedByTheKernel) {
  CanSettings s = settings();
  s.receive_buffer_bytes = 4096;
  auto sut = open_can(s, clock), peer = open();
  constexpr std::uint32_t kSent = 500;
  for (std::uint32_t i = 0; i < kSent; ++i) ASSERT_TRUE(send_all_the_same(*peer, numbered(1, i)));
  std::uint64_t heard = 0;
  while (sut->try_receive().value()) ++heard;
  EXPECT_LT(heard, kSent);
  // The count travels with the next frame that is received.
  ASSERT_TRUE(send_all_the_same(*peer, numbered(1, kSent)));
  ASSERT_TRUE(next_frame(*sut));
  EXPECT_EQ(heard + sut->counters().receive_dropped, kSent);
}

TEST_F(SocketCan, FullQueueIsRefusedWithEnobufs) {
  if (!run("tc qdisc add dev " + name + " root tbf rate 8kbit burst 100b limit 1000b"))
    GTEST_SKIP() << "cannot slow the interface down (tc, sch_tbf)";
  auto sut = open();
  int sent = 0;
  Status s;
  for (; sent < 10'000; ++sent)
    if (!(s = sut->try_send(numbered(1, sent))).ok()) break;
  ASSERT_FALSE(s.ok()) << sent;
  EXPECT_EQ(s.error().code, ErrorCode::kRefused);
  EXPECT_EQ(s.error().os_errno, ENOBUFS);
  EXPECT_EQ(sut->counters().send_buffer_full, 1u);
  EXPECT_EQ(sut->state(), CanState::kErrorActive);
}

TEST_F(SocketCan, InterfaceThatGoesDownComesBack) {
  auto sut = open(), peer = open();
  ASSERT_TRUE(run("ip link set " + name + " down"));
  EXPECT_TRUE(eventually([&] { return !sut->try_receive().ok(); }));
  EXPECT_EQ(sut->state(), CanState::kDown);
  const Status s = sut->try_send(frame_of(1));
  EXPECT_EQ(s.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(s.error().os_errno, ENETDOWN);
  ASSERT_TRUE(run("ip link set " + name + " up"));
  EXPECT_FALSE(sut->try_receive().ok()) << "nobody has looked for it";
  ASSERT_TRUE(eventually([&] { return sut->reopen().ok(); }));
  ASSERT_TRUE(eventually([&] { return peer->try_receive().ok() || peer->reopen().ok(); }));
  EXPECT_EQ(sut->state(), CanState::kErrorActive);
  ASSERT_TRUE(peer->try_send(frame_of(0x31)).ok());
  EXPECT_EQ(must_hear(*sut).id, 0x31);
  EXPECT_EQ(sut->counters().reopened, 1u);
}

TEST_F(SocketCan, SenderAloneNoticesThatTheInterfaceIsDown) {
  auto sut = open();
  ASSERT_TRUE(run("ip link set " + name + " down"));
  EXPECT_EQ(sut->try_send(frame_of(1)).error().os_errno, ENETDOWN);
  EXPECT_EQ(sut->state(), CanState::kDown);
}

TEST_F(SocketCan, InterfaceThatIsUnpluggedComesBackWithItsFilters) {
  CanSettings filtered = settings();
  filtered.filters = {{0x32, 0x7FF}, {0x42, 0x7FF}};
  auto sut = open_can(filtered, clock);
  ASSERT_TRUE(remove());
  EXPECT_TRUE(
      eventually([&] { return !sut->try_receive().ok() && !sut->reopen().ok() && sut->state() == CanState::kGone; }));
  EXPECT_EQ(sut->try_send(frame_of(1)).error().os_errno, ENODEV);
  ASSERT_TRUE(run("ip link add " + name + " type vcan"));
  EXPECT_TRUE(eventually([&] { return !sut->reopen().ok() && sut->state() == CanState::kDown; }))
      << "there, but not yet up";
  ASSERT_TRUE(run("ip link set " + name + " up"));
  ASSERT_TRUE(eventually([&] { return sut->reopen().ok(); }));
  auto peer = open();
  ASSERT_TRUE(peer->try_send(frame_of(0x31)).ok());
  ASSERT_TRUE(peer->try_send(frame_of(0x32)).ok());
  EXPECT_EQ(must_hear(*sut).id, 0x32);
  ASSERT_TRUE(sut->try_send(frame_of(0x33)).ok());
  EXPECT_EQ(must_hear(*peer).id, 0x33);
  EXPECT_EQ(sut->counters().foreign, 0u) << "the kernel keeps the others away again";
  RawSocket(name).send(raw_error(CAN_ERR_ACK));
  EXPECT_TRUE(eventually([&] { return digest(*sut), sut->counters().no_ack == 1; }));
  EXPECT_EQ(sut->counters().reopened, 1u);
}

TEST_F(SocketCan, TwoControllersHearEachOther) {
  if (!::if_nametoindex("can0") || !::if_nametoindex("can1")) GTEST_SKIP() << "no can0 and can1 on one bus";
  CanSettings s0 = settings(), s1 = settings();
  s0.interface = "can0";
  s1.interface = "can1";
  s0.bitrate = s1.bitrate = 1'000'000;
  auto a = open_can(s0, clock), b = open_can(s1, clock);
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(send_all_the_same(*a, numbered(0x10, i)));
    const auto there = next_frame(*b);
    ASSERT_TRUE(there);
    ASSERT_EQ(number_of(*there), i);
    ASSERT_TRUE(send_all_the_same(*b, numbered(0x11, i)));
    const auto back = next_frame(*a);
    ASSERT_TRUE(back);
    ASSERT_EQ(number_of(*back), i);
  }
  EXPECT_EQ(a->state(), CanState::kErrorActive);
}

TEST_F(SocketCan, CandumpWritesTheSameLogAsWe) {
  if (!installed("candump")) GTEST_SKIP() << "candump (can-utils) is not installed";
  const auto theirs = folder.path() / "theirs.log", ours = folder.path() / "can.log";
  const RawSocket peer(name);
  const auto dumped = [&](const std::string& frame) {
    const std::string text = folder.read("theirs.log");
    int count = 0;
    for (std::size_t at = text.find(frame); at != std::string::npos; at = text.find(frame, at + 1)) ++count;
    return count;
  };
  // The filter expression asks for error frames besides.
  Program candump({"stdbuf", "-oL", "candump", "-L", name + ",0:0,#FFFFFFFF"}, theirs);
  ASSERT_TRUE(eventually([&] { return peer.send(raw_frame(0x7FF)), dumped("7FF#") > 0; }));
  CanRecorder recorder(settings(), ours);
  peer.send(raw_frame(0x000));
  auto node = open();
  for (std::uint32_t i = 0; i < 200; ++i) {
    ASSERT_TRUE(send_all_the_same(*node, numbered(0x100 + i, i)));
    CanFrame shorter = numbered(0x400 + i, i);
    shorter.length = i % 9;
    ASSERT_TRUE(send_all_the_same(*node, shorter));
    peer.send(raw_frame((0x12345 + i) | CAN_EFF_FLAG, {1, 2, 3}));
    peer.send(raw_frame(0x50 | CAN_RTR_FLAG));
    // candump's own socket holds some 250 frames and loses the rest.
    if (i % 25 == 24) {
      ASSERT_TRUE(eventually([&] { return dumped(" 050#R") == static_cast<int>(i) + 1; })) << i;
    }
  }
  can_frame remote = raw_frame(0x51 | CAN_EFF_FLAG | CAN_RTR_FLAG);
  remote.can_dlc = 4;
  peer.send(remote);
  peer.send(raw_error(CAN_ERR_CRTL | CAN_ERR_BUSERROR, 1, CAN_ERR_CRTL_TX_PASSIVE));
  peer.send(raw_frame(0x001, {0xFF}));
  ASSERT_TRUE(eventually([&] { return folder.read("theirs.log").ends_with("001#FF\n"); }));
  candump.end(SIGTERM);
  recorder.stop();
  std::string expected = folder.read("theirs.log");
  expected.erase(0, expected.find(" 000#\n") - (19 + 1 + name.size()));  // back to the start of that line
  const std::string found = folder.read("can.log");
  EXPECT_EQ(found, expected);
  EXPECT_EQ(recorder.counters().recorded, 804u);
}

TEST_F(SocketCan, CanplayerReplaysOurLog) {
  if (!installed("canplayer")) GTEST_SKIP() << "canplayer (can-utils) is not installed";
  std::string text;
  std::vector<CanLogEntry> entries;
  for (std::uint32_t i = 0; i < 100; ++i) {
    CanLogEntry e;
    e.wall_ns = 1'700'000'000'000'000'000 + i * 1'000'000;
    e.interface = name;
    e.frame.can_id = i * 20;
    e.frame.len = i % 9;
    for (int k = 0; k < e.frame.len; ++k) e.frame.data[k] = static_cast<std::uint8_t>(3 * i + k);
    append_line(e, text);
    text += '\n';
    entries.push_back(e);
  }
  const auto file = folder.write("can.log", text);
  auto sut = open();
  ASSERT_TRUE(run("canplayer -I '" + file.string() + "'"));
  for (const CanLogEntry& e : entries) {
    const auto f = next_frame(*sut);
    ASSERT_TRUE(f);
    ASSERT_EQ(f->id, e.frame.can_id);
    ASSERT_EQ(f->length, e.frame.len);
    ASSERT_EQ(std::memcmp(f->data.data(), e.frame.data, f->length), 0);
  }
}

TEST_F(SocketCan, CanbusloadCountsTheSameBits) {
  if (!installed("canbusload")) GTEST_SKIP() << "canbusload (can-utils) is not installed";
  const auto output = folder.path() / "load.txt";
  // Prints once a second "NAME@BITRATE FRAMES BITS PAYLOAD LOAD%", with exact stuffing.
  Program canbusload({"stdbuf", "-oL", "canbusload", "-e", name + "@1000000"}, output);
  ASSERT_TRUE(eventually([&] { return folder.read("load.txt").find(name) != std::string::npos; }));
  const RawSocket peer(name);
  long bits = 0, frames = 0;
  for (std::uint32_t i = 0; i < 200; ++i) {
    can_frame f = raw_frame(i % 2 ? i : (i * 999'983) % CAN_EFF_MASK | CAN_EFF_FLAG);
    f.can_dlc = i % 9;
    for (int k = 0; k < f.can_dlc; ++k) f.data[k] = i % 3 ? static_cast<std::uint8_t>(i * 31 + k * 7) : 0;
    peer.send(f);
    bits += frame_bits(f);
    ++frames;
  }
  long seen_bits = 0, seen_frames = 0;
  ASSERT_TRUE(eventually([&] {
    std::stringstream words(folder.read("load.txt"));
    std::string word;
    seen_bits = seen_frames = 0;
    while (words >> word)
      if (long f = 0, b = 0; word.starts_with(name) && words >> f >> b) {
        seen_frames += f;
        seen_bits += b;
      }
    return seen_frames == frames;
  })) << folder.read("load.txt");
  EXPECT_EQ(seen_bits, bits);
}

}  // namespace
}  // namespace tankrig
