// The CAN driver on the kernel's own CAN stack while controllers, queues and interfaces fail and come back.
#include <gtest/gtest.h>

#include <cerrno>

#include "drivers/can/open_can.hpp"
#include "tests/kernel/guest.hpp"

namespace tankrig::test {
namespace {

constexpr auto kUp = "up type can bitrate 500000 restart-ms ";

std::unique_ptr<CanBus> open_bus(const std::string& interface, const Clock& clock) {
  CanSettings settings;
  settings.interface = interface;
  return open_can(settings, clock);
}

/// Two nodes on rigcan0 and rigcan1; faults are put on rigcan0.
class CanFaults : public testing::Test {
 protected:
  void SetUp() override {
    set_link("rigcan0", kUp + std::to_string(200));
    set_link("rigcan1", kUp + std::to_string(200));
    node_ = open_bus("rigcan0", clock_);
    peer_ = open_bus("rigcan1", clock_);
  }
  void TearDown() override {
    set_link("rigcan0", "down");
    set_link("rigcan1", "down");
  }

  /// In both directions.
  void expect_traffic() {
    ASSERT_TRUE(send_within(*node_, frame_of(0x123, {1, 2, 3})));
    const auto there = receive_within(*peer_);
    ASSERT_TRUE(there);
    EXPECT_EQ(there->id, 0x123);
    EXPECT_EQ(there->data[2], 3);
    ASSERT_TRUE(send_within(*peer_, frame_of(0x321, {7})));
    const auto back = receive_within(*node_);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->id, 0x321);
  }

  /// Sends until a frame arrives: between the controller's restart and the kernel's notice of the carrier, its queue
  /// takes frames and drops them without a word.
  bool carries_again() {
    const bool carries = becomes_true([&] {
      (void)node_->try_send(frame_of(0x124, {}));
      return receive_within(*peer_, std::chrono::milliseconds(50)).has_value();
    });
    while (receive_within(*peer_, std::chrono::milliseconds(50))) {
    }
    return carries;
  }

  MonotonicClock clock_;
  std::unique_ptr<CanBus> node_, peer_;
};

TEST_F(CanFaults, ErrorStatesAreToldAsTheControllerReachesThemAndLeavesThem) {
  expect_traffic();
  EXPECT_EQ(node_->state(), CanState::kErrorActive);
  EXPECT_EQ(node_->counters().error_frames, 0u);
  set_fault("rigcan0", "warn");
  EXPECT_TRUE(reaches(*node_, CanState::kErrorWarning));
  expect_traffic();
  set_fault("rigcan0", "passive");
  EXPECT_TRUE(reaches(*node_, CanState::kErrorPassive));
  expect_traffic();
  set_fault("rigcan0", "active");
  EXPECT_TRUE(reaches(*node_, CanState::kErrorActive));
  expect_traffic();
  EXPECT_EQ(node_->counters().error_frames, 3u);
  EXPECT_EQ(peer_->counters().error_frames, 0u);
}

TEST_F(CanFaults, BusOffIsLeftByTheKernelsRestart) {
  set_link("rigcan0", "down");
  set_link("rigcan0", kUp + std::to_string(3000));
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  expect_traffic();
  const Stamp begin = clock_.now();
  set_fault("rigcan0", "busoff");
  ASSERT_TRUE(reaches(*node_, CanState::kBusOff, std::chrono::milliseconds(2700)));
  EXPECT_FALSE(node_->try_send(frame_of(0x123, {1})).ok());
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  EXPECT_GE(clock_.now() - begin, std::chrono::milliseconds(2990));  // less a jiffy
  EXPECT_EQ(node_->counters().bus_off, 1u);
  EXPECT_EQ(node_->counters().restarted, 1u);
  EXPECT_TRUE(carries_again());
  expect_traffic();
}

TEST_F(CanFaults, BusOffWithoutRestartLastsUntilSomebodyRestartsByHand) {
  set_link("rigcan0", "down");
  set_link("rigcan0", kUp + std::to_string(0));
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  set_fault("rigcan0", "busoff");
  ASSERT_TRUE(reaches(*node_, CanState::kBusOff));
  EXPECT_FALSE(reaches(*node_, CanState::kErrorActive, std::chrono::milliseconds(500)));
  set_link("rigcan0", "type can restart");
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  EXPECT_EQ(node_->counters().bus_off, 1u);
  EXPECT_TRUE(carries_again());
}

TEST_F(CanFaults, BusOffIsLeftByDownAndUp) {
  set_link("rigcan0", "down");
  set_link("rigcan0", kUp + std::to_string(0));
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  set_fault("rigcan0", "busoff");
  ASSERT_TRUE(reaches(*node_, CanState::kBusOff));
  set_link("rigcan0", "down");
  ASSERT_TRUE(reaches(*node_, CanState::kDown));
  set_link("rigcan0", "up");
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  EXPECT_TRUE(carries_again());
}

TEST_F(CanFaults, AFrameThatNobodyAcknowledgesIsToldAndArrivesWhenSomebodyDoes) {
  set_fault("rigcan0", "noack");
  ASSERT_TRUE(send_within(*node_, frame_of(0x123, {9})));
  EXPECT_TRUE(reaches(*node_, CanState::kErrorPassive));
  EXPECT_EQ(node_->counters().no_ack, 1u);
  EXPECT_FALSE(receive_within(*peer_, std::chrono::milliseconds(50)));
  set_fault("rigcan0", "active");
  const auto frame = receive_within(*peer_);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->data[0], 9);
  EXPECT_TRUE(reaches(*node_, CanState::kErrorActive));
}

TEST_F(CanFaults, APeerThatIsSwitchedOffIsNoAcknowledgement) {
  set_link("rigcan1", "down");
  ASSERT_TRUE(reaches(*peer_, CanState::kDown));
  ASSERT_TRUE(send_within(*node_, frame_of(0x123, {9})));
  EXPECT_TRUE(reaches(*node_, CanState::kErrorPassive));
  EXPECT_EQ(node_->counters().no_ack, 1u);
  set_link("rigcan1", "up");
  ASSERT_TRUE(becomes_true([&] { return peer_->reopen().ok(); }));
  ASSERT_TRUE(receive_within(*peer_));
  EXPECT_TRUE(reaches(*node_, CanState::kErrorActive));
  EXPECT_TRUE(carries_again());
  expect_traffic();
}

TEST_F(CanFaults, AFullQueueRefusesWithEnobufsAndLosesNothingItTook) {
  expect_traffic();
  const std::uint64_t before = node_->counters().sent;
  set_fault("rigcan0", "txfull");
  std::uint8_t taken = 0;
  Status sent;
  while (taken < 200 && (sent = node_->try_send(frame_of(0x100, {taken}))).ok()) ++taken;
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::kRefused);
  EXPECT_EQ(sent.error().os_errno, ENOBUFS);
  EXPECT_GE(taken, 10);
  EXPECT_EQ(node_->counters().send_buffer_full, 1u);
  EXPECT_EQ(node_->counters().sent, before + taken);
  EXPECT_EQ(node_->state(), CanState::kErrorActive);
  set_fault("rigcan0", "active");
  for (int i = 0; i < taken; ++i) {
    const auto frame = receive_within(*peer_);
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->data[0], i);
  }
  expect_traffic();
}

TEST_F(CanFaults, AFrameLostInTheReceivingControllerIsCounted) {
  set_fault("rigcan0", "rxoverflow");
  ASSERT_TRUE(send_within(*peer_, frame_of(0x111, {1})));
  ASSERT_TRUE(send_within(*peer_, frame_of(0x111, {2})));
  const auto frame = receive_within(*node_);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->data[0], 2);
  EXPECT_EQ(node_->counters().controller_overflow, 1u);
  EXPECT_EQ(node_->counters().error_frames, 1u);
}

TEST_F(CanFaults, AnInterfaceThatGoesDownIsToldAndUsedAgainWhenItIsUp) {
  expect_traffic();
  set_link("rigcan0", "down");
  ASSERT_TRUE(reaches(*node_, CanState::kDown));
  const Status sent = node_->try_send(frame_of(0x123, {}));
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(sent.error().os_errno, ENETDOWN);
  set_link("rigcan0", "up");
  ASSERT_TRUE(reaches(*node_, CanState::kErrorActive));
  EXPECT_EQ(node_->counters().reopened, 1u);
  EXPECT_TRUE(carries_again());
  expect_traffic();
}

TEST_F(CanFaults, AnotherBitrateIsNoAcknowledgement) {
  set_link("rigcan1", "down");
  set_link("rigcan1", "up type can bitrate 250000");
  ASSERT_TRUE(send_within(*node_, frame_of(0x123, {})));
  EXPECT_TRUE(reaches(*node_, CanState::kErrorPassive));
  EXPECT_EQ(node_->counters().no_ack, 1u);
}

void expect_gone_and_back(const std::string& interface, const std::function<void()>& remove,
                          const std::function<void()>& restore) {
  MonotonicClock clock;
  const auto node = open_bus(interface, clock);
  remove();
  ASSERT_TRUE(reaches(*node, CanState::kGone));
  const auto received = node->try_receive();
  ASSERT_FALSE(received.ok());
  EXPECT_EQ(received.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(received.error().os_errno, ENODEV);
  restore();
  ASSERT_TRUE(reaches(*node, CanState::kErrorActive));
  EXPECT_GE(node->counters().reopened, 1u);
  const auto peer = open_bus(interface == "can1" ? "can0" : interface, clock);
  ASSERT_TRUE(send_within(*peer, frame_of(0x77, {5})));
  const auto frame = receive_within(*node);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 0x77);
}

TEST(CanFaultsOfAnInterface, VirtualInterfaceGoneAndBack) {
  expect_gone_and_back(
      "vcan0", [] { shell("ip link del vcan0"); },
      [] { shell("ip link add vcan0 type vcan && ip link set vcan0 up"); });
}

TEST(CanFaultsOfAnInterface, ControllerPulledOutOfItsBusAndPutBack) {
  const std::string device = shell("basename -z $(readlink /sys/class/net/can1/device) | tr -d '\\0'");
  const std::string driver = "/sys/bus/pci/drivers/kvaser_pci/";
  expect_gone_and_back(
      "can1", [&] { shell("echo " + device + " > " + driver + "unbind"); },
      [&] {
        shell("echo " + device + " > " + driver + "bind");
        set_link("can1", "up txqueuelen 1000 type can bitrate 1000000 restart-ms 100");
      });
}

}  // namespace
}  // namespace tankrig::test
