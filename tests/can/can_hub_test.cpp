// The bus that spans processes: order, pace, arbitration, faults, nodes that come and go.
#include "sim_backends/wire/can_hub.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "core/input_error.hpp"
#include "drivers/can/can_timing.hpp"
#include "tests/can/can_support.hpp"
#include "tests/support/machine_witness.hpp"

namespace tankrig::sim {
namespace {

using namespace can_test;

class CanHubTest : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  MonotonicClock clock;
  std::filesystem::path path = folder.path() / "can0.sock";

  CanHubSettings settings(int bitrate = 1'000'000) const {
    CanHubSettings s;
    s.path = path;
    s.bitrate = bitrate;
    return s;
  }
  CanSettings node_settings() const {
    CanSettings s;
    s.interface = "unix:" + path.string();
    s.reopen_period = std::chrono::milliseconds(1);
    return s;
  }
  std::unique_ptr<CanBus> node() { return open_can(node_settings(), clock); }
  /// How long the others took to wait for the frame sent at `began`: a test of who goes next needs it on the wire
  /// until then.
  struct Queueing {
    Stamp began, ended;
    Duration latest() const { return ended - began; }
  };
  static constexpr Duration kFrameOnSlowWire = std::chrono::milliseconds(55);  ///< 111 bits at 2 kbit/s, unstuffed

  /// Nodes with their numbers known: connected one after the other.
  std::unique_ptr<CanBus> node_number(CanHub& hub, std::size_t number) {
    auto bus = node();
    EXPECT_TRUE(eventually([&] { return hub.report().nodes.size() == number + 1; }));
    return bus;
  }
};

TEST_F(CanHubTest, EveryFrameReachesAllOthersInOrderAndNotItsSender) {
  const CanHub hub(settings());
  auto a = node(), b = node(), c = node();
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(send_all_the_same(*a, numbered(0x20, i)));
  for (CanBus* listener : {b.get(), c.get()}) {
    Stamp last{};
    for (int i = 0; i < 300; ++i) {
      const auto f = next_frame(*listener);
      ASSERT_TRUE(f);
      ASSERT_EQ(number_of(*f), static_cast<std::uint32_t>(i));
      ASSERT_GE(f->stamp, last);
      last = f->stamp;
    }
  }
  EXPECT_FALSE(a->try_receive().value());
  EXPECT_EQ(hub.report().frames, 300u);
}

TEST_F(CanHubTest, FramesTakeTheirTimeOnTheWire) {
  constexpr int kFrames = 1000, kBitrate = 1'000'000;
  CanHub hub(settings(kBitrate));
  auto a = node(), b = node();
  can_frame raw{};
  Duration wire{};
  const Stamp begin = clock.now();
  std::jthread sender([&] {
    for (int i = 0; i < kFrames; ++i) EXPECT_TRUE(send_all_the_same(*a, numbered(0x123, i)));
  });
  Stamp end{};
  for (int i = 0; i < kFrames; ++i) {
    const auto f = next_frame(*b);
    ASSERT_TRUE(f);
    end = f->stamp;
    raw.can_id = f->id;
    raw.can_dlc = f->length;
    std::copy(f->data.begin(), f->data.end(), raw.data);
    wire += bits_duration(frame_bits(raw), kBitrate);
  }
  // A stamp is converted from the wall clock with an error of microseconds.
  EXPECT_GE(end - begin, wire - std::chrono::microseconds(20));
  EXPECT_EQ(hub.report().busy, wire);
  EXPECT_GT(wire, std::chrono::milliseconds(110));
  std::printf("%d frames: %.3f ms on the wire, %.3f ms taken\n", kFrames, seconds(wire) * 1e3,
              seconds(end - begin) * 1e3);
}

TEST_F(CanHubTest, LowestIdentifierGoesFirstAmongThoseWaiting) {
  CanHub hub(settings(2'000));  // all wait while the first is on its way
  auto listener = node(), a = node(), b = node(), c = node();
  const Stamp began = clock.now();
  ASSERT_TRUE(a->try_send(numbered(0x700, 0)).ok());
  ASSERT_TRUE(eventually([&] { return hub.report().busy > Duration{0}; }));
  ASSERT_TRUE(a->try_send(numbered(0x300, 0)).ok());
  ASSERT_TRUE(a->try_send(numbered(0x001, 0)).ok());  // behind 0x300 in the same controller
  ASSERT_TRUE(b->try_send(numbered(0x200, 0)).ok());
  ASSERT_TRUE(c->try_send(numbered(0x100, 0)).ok());
  ASSERT_TRUE(c->try_send(numbered(0x7FF, 0)).ok());
  TANKRIG_SKIP_IF_LATE((Queueing{began, clock.now()}), kFrameOnSlowWire);
  std::vector<int> order;
  for (int i = 0; i < 6; ++i) order.push_back(must_hear(*listener).id);
  EXPECT_EQ(order, (std::vector<int>{0x700, 0x100, 0x200, 0x300, 0x001, 0x7FF}));
}

TEST_F(CanHubTest, StandardWinsOverExtendedAndDataOverRemote) {
  CanHub hub(settings(2'000));
  auto first = node(), a = node(), b = node(), c = node();
  auto [observer, _] = CanCarrier::pair();
  observer = CanCarrier::open(node_settings(), CanCarrier::Role::kListener);
  const Stamp began = clock.now();
  ASSERT_TRUE(first->try_send(numbered(0x7FF, 0)).ok());
  ASSERT_TRUE(eventually([&] { return hub.report().busy > Duration{0}; }));
  ASSERT_TRUE(send_raw(a->descriptor(), raw_frame(0x100u << 18 | CAN_EFF_FLAG)));
  ASSERT_TRUE(send_raw(b->descriptor(), raw_frame(0x100 | CAN_RTR_FLAG)));
  ASSERT_TRUE(send_raw(c->descriptor(), raw_frame(0x100)));
  TANKRIG_SKIP_IF_LATE((Queueing{began, clock.now()}), kFrameOnSlowWire);
  std::vector<canid_t> order;
  ASSERT_TRUE(eventually([&] {
    can_frame f{};
    if (::recv(observer.descriptor(), &f, sizeof f, MSG_DONTWAIT) == sizeof f) order.push_back(f.can_id);
    return order.size() == 4;
  }));
  EXPECT_EQ(order, (std::vector<canid_t>{0x7FF, 0x100, 0x100 | CAN_RTR_FLAG, 0x100u << 18 | CAN_EFF_FLAG}));
}

TEST_F(CanHubTest, SpansProcesses) {
  CanHub hub(settings());
  auto here = node();
  const pid_t child = ::fork();
  if (child == 0) {
    // Echoes with the identifier raised by one, then leaves.
    int echoed = 0;
    {
      MonotonicClock time;
      auto bus = open_can(node_settings(), time);
      while (echoed < 200) {
        const auto f = next_frame(*bus);
        if (!f) break;
        CanFrame answer = *f;
        ++answer.id;
        if (!send_all_the_same(*bus, answer)) break;
        ++echoed;
      }
    }
    ::_exit(echoed == 200 ? 0 : 1);
  }
  ASSERT_TRUE(eventually([&] { return hub.report().nodes.size() == 2; }));
  EXPECT_EQ(hub.report().nodes[1].process, child);
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(send_all_the_same(*here, numbered(0x10, i)));
    const auto answer = next_frame(*here);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->id, 0x11);
    EXPECT_EQ(number_of(*answer), static_cast<std::uint32_t>(i));
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(eventually([&] { return hub.report().nodes.size() == 1; })) << "a node that leaves is noticed";
}

TEST_F(CanHubTest, KilledNodeIsNoticedAndTheBusGoesOn) {
  CanHub hub(settings());
  auto a = node(), b = node();
  const pid_t child = ::fork();
  if (child == 0) {
    MonotonicClock time;
    auto bus = open_can(node_settings(), time);
    ::pause();
    ::_exit(0);
  }
  ASSERT_TRUE(eventually([&] { return hub.report().nodes.size() == 3; }));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_TRUE(eventually([&] { return hub.report().nodes.size() == 2; }));
  ASSERT_TRUE(a->try_send(frame_of(1)).ok());
  EXPECT_TRUE(next_frame(*b));
}

TEST_F(CanHubTest, WithNobodyToAcknowledgeTheQueueFillsAsOnARealBus) {
  CanHub hub(settings());
  auto a = node();
  std::uint32_t sent = 0;
  ASSERT_TRUE(eventually([&] {
    const Status s = a->try_send(numbered(1, sent));
    if (s.ok()) ++sent;
    digest(*a);
    // The queue of the node fills after the one of the controller.
    return !s.ok() && s.error().os_errno == ENOBUFS && sent >= 16 + 64 && a->counters().no_ack == 1 &&
           a->state() == CanState::kErrorPassive;
  }));
  EXPECT_EQ(hub.report().frames, 0u);

  auto b = node();
  for (std::uint32_t i = 0; i < sent; ++i) {
    const auto f = next_frame(*b);
    ASSERT_TRUE(f);
    ASSERT_EQ(number_of(*f), i);
  }
  EXPECT_TRUE(eventually([&] { return digest(*a), a->state() == CanState::kErrorActive; }));
}

TEST_F(CanHubTest, TakesNoProcessorForAFullNodeWhoseProgramHasEnded) {
  const auto used = [] {
    timespec t{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return std::chrono::seconds{t.tv_sec} + std::chrono::nanoseconds{t.tv_nsec};
  };
  CanHub hub(settings());
  {
    const auto full = node();
    ASSERT_TRUE(eventually([&] {
      const Status s = full->try_send(frame_of(1));
      return !s.ok() && s.error().os_errno == ENOBUFS;
    }));
  }
  const auto before = used();
  const Stamp end = clock.now() + std::chrono::milliseconds{200};
  ASSERT_TRUE(eventually([&] { return clock.now() >= end; }));
  EXPECT_LT(used() - before, std::chrono::milliseconds{100});
}

TEST_F(CanHubTest, ListenerHearsAllAndAcknowledgesNothing) {
  CanHub hub(settings());
  auto a = node();
  const CanCarrier listener = CanCarrier::open(node_settings(), CanCarrier::Role::kListener);
  ASSERT_TRUE(eventually([&] {
    const auto nodes = hub.report().nodes;
    return nodes.size() == 2 && nodes[1].listens_only;
  }));
  ASSERT_TRUE(a->try_send(frame_of(0x77)).ok());
  EXPECT_TRUE(eventually([&] { return digest(*a), a->counters().no_ack == 1; }));
  auto b = node();
  can_frame f{};
  ASSERT_TRUE(eventually([&] { return ::recv(listener.descriptor(), &f, sizeof f, MSG_DONTWAIT) == sizeof f; }));
  EXPECT_EQ(f.can_id, 0x77u);
  EXPECT_EQ(must_hear(*b).id, 0x77);
}

TEST_F(CanHubTest, NodeThatDoesNotReadOverflowsAndIsTold) {
  CanHubSettings s = settings();
  s.receive_queue_bytes = 4096;
  CanHub hub(s);
  auto a = node_number(hub, 0), slow = node_number(hub, 1), b = node_number(hub, 2);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(send_all_the_same(*a, numbered(1, i)));
    ASSERT_TRUE(next_frame(*b)) << "one slow node does not hold the others";
  }
  const auto overflowed = hub.report().nodes[1].overflowed;
  EXPECT_GT(overflowed, 50u);
  std::uint64_t heard = 0;
  while (slow->try_receive().value()) ++heard;
  EXPECT_EQ(heard + overflowed, 100u);
  ASSERT_TRUE(a->try_send(numbered(1, 100)).ok());
  EXPECT_EQ(number_of(must_hear(*slow)), 100u);
  EXPECT_EQ(slow->counters().controller_overflow, 1u);
}

TEST_F(CanHubTest, HandsErrorFramesToOneNodeOrToEveryone) {
  CanHub hub(settings());
  auto a = node_number(hub, 0), b = node_number(hub, 1);

  hub.inject(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_RX_WARNING), 1);
  EXPECT_TRUE(eventually([&] { return digest(*b), b->state() == CanState::kErrorWarning; }));
  digest(*a);
  EXPECT_EQ(a->counters().error_frames, 0u);
  hub.inject(raw_error(CAN_ERR_PROT));
  EXPECT_TRUE(eventually([&] { return digest(*a), a->counters().bus_errors == 1; }));
  EXPECT_TRUE(eventually([&] { return digest(*b), b->counters().bus_errors == 1; }));
}

TEST_F(CanHubTest, BusOffNodeIsDeafAndMuteUntilItsRestart) {
  CanHub hub(settings());
  auto a = node_number(hub, 0), b = node_number(hub, 1), c = node_number(hub, 2);
  hub.bus_off(0, std::nullopt);
  EXPECT_TRUE(eventually([&] { return digest(*a), a->state() == CanState::kBusOff; }));
  EXPECT_EQ(a->try_send(frame_of(1)).error().code, ErrorCode::kNotReady);
  ASSERT_TRUE(eventually([&] { return hub.report().discarded == 1; }));
  ASSERT_TRUE(b->try_send(frame_of(2)).ok());
  ASSERT_TRUE(next_frame(*c));
  digest(*a);
  EXPECT_EQ(a->counters().received, 0u);

  hub.bus_off(0, std::chrono::milliseconds(20));
  EXPECT_TRUE(eventually([&] { return digest(*a), a->counters().restarted == 1; }));
  EXPECT_EQ(a->state(), CanState::kErrorActive);
  ASSERT_TRUE(a->try_send(frame_of(3)).ok());
  EXPECT_EQ(must_hear(*c).id, 3);
}

TEST_F(CanHubTest, NodeComesBackToABusThatIsStartedAgain) {
  auto hub = std::make_unique<CanHub>(settings());
  auto a = node(), b = node();
  hub.reset();
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(eventually([&] { return !a->try_receive().ok() && !b->try_receive().ok(); }));
  EXPECT_EQ(a->state(), CanState::kGone);
  EXPECT_EQ(a->try_send(frame_of(1)).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(a->reopen().error().code, ErrorCode::kNotReady);
  hub = std::make_unique<CanHub>(settings());
  EXPECT_FALSE(a->try_receive().ok()) << "nobody has looked for it";
  EXPECT_TRUE(eventually([&] { return a->reopen().ok() && b->reopen().ok(); }));
  ASSERT_TRUE(a->try_send(frame_of(0x42)).ok());
  EXPECT_EQ(must_hear(*b).id, 0x42);
  EXPECT_EQ(a->counters().reopened, 1u);
}

TEST_F(CanHubTest, WrongDatagramsAreCountedAndGoNowhere) {
  CanHub hub(settings());
  auto a = node(), b = node();
  const std::uint8_t bytes[100] = {};
  for (const std::size_t size : {0u, 3u, 15u, 17u, 72u, 100u}) ASSERT_TRUE(send_raw(a->descriptor(), bytes, size));
  ASSERT_TRUE(a->try_send(frame_of(9)).ok());
  EXPECT_EQ(must_hear(*b).id, 9);
  EXPECT_EQ(b->counters().foreign, 0u);
  EXPECT_EQ(hub.report().malformed, 6u);
}

TEST_F(CanHubTest, RefusesABusThatIsServedAndReplacesAStaleOne) {
  {
    const CanHub hub(settings());
    EXPECT_NE(message_of<InputError>([&] { CanHub second(settings()); }).find("served by another process"),
              std::string::npos);
  }
  // What a killed emulator leaves behind: the file of a socket that nobody listens on.
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.native().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ::close(fd);
  ASSERT_TRUE(std::filesystem::exists(path));
  EXPECT_NE(message_of<InputError>([&] { node(); }).find("start its emulator first"), std::string::npos);
  const CanHub hub(settings());
  EXPECT_TRUE(node());
}

TEST_F(CanHubTest, RefusesPathsItCannotServe) {
  const auto message = [](const std::filesystem::path& p) {
    CanHubSettings s;
    s.path = p;
    return message_of<InputError>([&] { CanHub hub(s); });
  };
  EXPECT_NE(message(folder.path() / std::string(120, 'x')).find("expected 1 to 107: choose a shorter"),
            std::string::npos);
  EXPECT_NE(message("").find("expected 1 to 107"), std::string::npos);
  EXPECT_NE(message(folder.path() / "no" / "such").find("No such file"), std::string::npos);
  EXPECT_NE(message(folder.write("file", "precious")).find("is not a socket"), std::string::npos);
  EXPECT_EQ(folder.read("file"), "precious");
}

TEST_F(CanHubTest, StopsPromptlyWhateverIsOnTheWire) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) {
    CanHub hub(settings(10'000));
    auto a = node(), b = node();
    for (int k = 0; k < 10; ++k) ASSERT_TRUE(a->try_send(numbered(1, k)).ok());
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

}  // namespace
}  // namespace tankrig::sim
