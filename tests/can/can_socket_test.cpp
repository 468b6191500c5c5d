// A node on the carrier that every machine has: a pair in this process.
#include "drivers/can/can_socket.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <random>

#include "tests/can/can_support.hpp"

namespace tankrig {
namespace {

using namespace can_test;

class CanPair : public ::testing::Test {
 protected:
  MonotonicClock clock;
  std::unique_ptr<CanBus> a, b;
  void SetUp() override { std::tie(a, b) = make_can_pair(clock); }
  /// Puts raw bytes on the wire to `a`.
  void inject(const can_frame& f) { ASSERT_TRUE(send_raw(b->descriptor(), f)); }
};

TEST_F(CanPair, CarriesFramesInOrderWithStampsThatDoNotDecrease) {
  Stamp last = clock.now();
  for (std::uint16_t i = 0; i < 50; ++i) {
    CanFrame f;
    f.id = i * 40;
    f.length = i % 9;
    for (int k = 0; k < f.length; ++k) f.data[k] = static_cast<std::uint8_t>(i + k);
    ASSERT_TRUE(a->try_send(f).ok());
  }
  const Stamp all_sent = clock.now();
  for (std::uint16_t i = 0; i < 50; ++i) {
    const auto r = b->try_receive();
    ASSERT_TRUE(r.ok());
    ASSERT_TRUE(r.value());
    const CanFrame& f = *r.value();
    EXPECT_EQ(f.id, i * 40);
    EXPECT_EQ(f.length, i % 9);
    for (int k = 0; k < 8; ++k) EXPECT_EQ(f.data[k], k < f.length ? static_cast<std::uint8_t>(i + k) : 0);
    EXPECT_GE(f.stamp, last);
    last = f.stamp;
  }
  // The kernel stamps a datagram when it is sent, not when it is read; its clock is read with microseconds of error.
  EXPECT_LE(last, all_sent + std::chrono::milliseconds(1));
  EXPECT_FALSE(b->try_receive().value());
  EXPECT_EQ(a->counters().sent, 50u);
  EXPECT_EQ(b->counters().received, 50u);
}

TEST_F(CanPair, FullQueueIsRefusedWithEnobufsAndCounted) {
  int sent = 0;
  Status status;
  for (; sent < 100'000; ++sent)
    if (!(status = a->try_send(numbered(1, sent))).ok()) break;
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kRefused);
  EXPECT_EQ(status.error().os_errno, ENOBUFS);
  EXPECT_EQ(a->counters().send_buffer_full, 1u);
  EXPECT_EQ(a->counters().sent, static_cast<std::uint64_t>(sent));
  EXPECT_EQ(a->state(), CanState::kErrorActive);
  for (int i = 0; i < sent; ++i) {
    const auto f = next_frame(*b);
    ASSERT_TRUE(f);
    ASSERT_EQ(number_of(*f), static_cast<std::uint32_t>(i)) << "a refused frame must not lose or repeat others";
  }
  EXPECT_TRUE(a->try_send(numbered(1, 0)).ok());
}

TEST_F(CanPair, RefusesFramesThatAreNone) {
  CanFrame f = frame_of(0x800);
  EXPECT_EQ(a->try_send(f).error().code, ErrorCode::kOutOfRange);
  f = frame_of(0x7FF);
  f.length = 9;
  EXPECT_EQ(a->try_send(f).error().code, ErrorCode::kOutOfRange);
  EXPECT_FALSE(b->try_receive().value());
}

TEST_F(CanPair, CountsForeignDatagramsAndDeliversNone) {
  inject(raw_frame(0x123 | CAN_EFF_FLAG, {1}));
  inject(raw_frame(0x123 | CAN_RTR_FLAG));
  can_frame too_long = raw_frame(0x123);
  too_long.can_dlc = 9;
  inject(too_long);
  const std::uint8_t bytes[200] = {};
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{15}, std::size_t{17}, sizeof(canfd_frame),
                                 std::size_t{73}, std::size_t{200}})
    ASSERT_TRUE(send_raw(b->descriptor(), bytes, size));
  EXPECT_FALSE(a->try_receive().value());
  EXPECT_EQ(a->counters().foreign, 10u);
  inject(raw_frame(0x123, {7}));
  EXPECT_EQ(must_hear(*a).data[0], 7);
  EXPECT_EQ(a->state(), CanState::kErrorActive);
}

TEST_F(CanPair, EndlessForeignTrafficDoesNotHoldTheCycle) {
  auto [near, far] = CanCarrier::pair();
  CanSettings settings;
  settings.filters = {{0x100, 0x7FF}};
  CanSocket sut(std::move(near), settings, clock);
  for (int i = 0; i < CanSocket::kLook + 1; ++i) ASSERT_TRUE(send_raw(far.descriptor(), raw_frame(0x101)));
  ASSERT_TRUE(send_raw(far.descriptor(), raw_frame(0x100)));
  EXPECT_FALSE(sut.try_receive().value());
  EXPECT_EQ(sut.counters().foreign, static_cast<std::uint64_t>(CanSocket::kLook));
  EXPECT_TRUE(sut.try_receive().value());
}

TEST_F(CanPair, FiltersByIdAndMask) {
  auto [near, far] = CanCarrier::pair();
  CanSettings settings;
  settings.filters = {{0x120, 0x7F0}, {0x201, 0x7FF}};
  CanSocket sut(std::move(near), settings, clock);
  for (const canid_t id : {0x11F, 0x120, 0x12F, 0x130, 0x200, 0x201, 0x202})
    ASSERT_TRUE(send_raw(far.descriptor(), raw_frame(id)));
  std::vector<int> seen;
  while (const auto f = sut.try_receive().value()) seen.push_back(f->id);
  EXPECT_EQ(seen, (std::vector<int>{0x120, 0x12F, 0x201}));
  EXPECT_EQ(sut.counters().foreign, 4u);
}

TEST_F(CanPair, ErrorFramesBecomeStatesAndCounts) {
  const auto state_after = [this](const can_frame& f) {
    inject(f);
    EXPECT_FALSE(a->try_receive().value()) << "an error frame is no data";
    return a->state();
  };
  EXPECT_EQ(state_after(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_WARNING)), CanState::kErrorWarning);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_RX_PASSIVE)), CanState::kErrorPassive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_RX_OVERFLOW)), CanState::kErrorPassive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_ACTIVE)), CanState::kErrorActive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_ACK)), CanState::kErrorActive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_LOSTARB)), CanState::kErrorActive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_TX_TIMEOUT)), CanState::kErrorActive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_PROT | CAN_ERR_BUSERROR, 2, CAN_ERR_PROT_STUFF)), CanState::kErrorActive);
  EXPECT_EQ(state_after(raw_error(CAN_ERR_BUSOFF)), CanState::kBusOff);
  const CanCounters c = a->counters();
  EXPECT_EQ(c.error_frames, 9u);
  EXPECT_EQ(c.no_ack, 1u);
  EXPECT_EQ(c.lost_arbitration, 1u);
  EXPECT_EQ(c.send_timeouts, 1u);
  EXPECT_EQ(c.bus_errors, 1u);
  EXPECT_EQ(c.controller_overflow, 1u);
  EXPECT_EQ(c.bus_off, 1u);
  EXPECT_EQ(c.received, 0u);
  EXPECT_EQ(c.foreign, 0u);
}

TEST_F(CanPair, BusOffIsNotReadyUntilTheRestart) {
  inject(raw_error(CAN_ERR_BUSOFF));
  digest(*a);
  const Status refused = a->try_send(frame_of(1));
  EXPECT_EQ(refused.error().code, ErrorCode::kNotReady);
  EXPECT_EQ(a->counters().sent, 0u);
  inject(raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_PASSIVE));
  digest(*a);
  EXPECT_EQ(a->state(), CanState::kBusOff) << "only a restart or traffic ends it";
  inject(raw_error(CAN_ERR_RESTARTED));
  digest(*a);
  EXPECT_EQ(a->state(), CanState::kErrorActive);
  EXPECT_EQ(a->counters().restarted, 1u);
  EXPECT_TRUE(a->try_send(frame_of(1)).ok());
}

TEST_F(CanPair, BusOffEndsWithTheFirstFrameReceived) {
  inject(raw_error(CAN_ERR_BUSOFF));
  digest(*a);
  ASSERT_EQ(a->state(), CanState::kBusOff);
  inject(raw_frame(0x10, {1}));
  ASSERT_TRUE(next_frame(*a));
  EXPECT_EQ(a->state(), CanState::kErrorActive);
}

TEST_F(CanPair, OtherEndThatClosedIsGoneForGoodAfterItsLastFrames) {
  ASSERT_TRUE(b->try_send(frame_of(5, {1, 2})).ok());
  ASSERT_TRUE(a->try_send(frame_of(6)).ok());  // never read: closing b resets the line
  b.reset();
  const auto last = a->try_receive();
  ASSERT_TRUE(last.ok());
  EXPECT_EQ(last.value()->id, 5);
  for (int i = 0; i < 3; ++i) {
    const auto r = a->try_receive();
    ASSERT_FALSE(r.ok());
    EXPECT_EQ(r.error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(r.error().os_errno, ENODEV);
  }
  EXPECT_EQ(a->try_send(frame_of(1)).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(a->state(), CanState::kGone);
  EXPECT_EQ(a->descriptor(), -1);
  EXPECT_EQ(a->counters().reopened, 0u);
}

TEST_F(CanPair, SendingToAClosedEndRaisesNoSignal) {
  b.reset();
  EXPECT_EQ(a->try_send(frame_of(1)).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(a->state(), CanState::kGone);
}

TEST_F(CanPair, VirtualClockStampsWithItsOwnTime) {
  VirtualClock time(Stamp{5'000});
  auto [c, d] = make_can_pair(time);
  ASSERT_TRUE(c->try_send(frame_of(1)).ok());
  EXPECT_EQ(must_hear(*d).stamp.ns, 5'000);
}

TEST_F(CanPair, StatisticsNameEveryCount) {
  CanCounters c;
  c.reopened = 7;
  const Statistics s = statistics_of(c, CanState::kBusOff);
  EXPECT_EQ(s.size(), sizeof(CanCounters) / sizeof(std::uint64_t) + 1);
  const auto value = [&s](const std::string& name) {
    for (const Statistic& x : s)
      if (x.name == name) return x.value;
    return -1.0;
  };
  EXPECT_EQ(value("can_reopened"), 7);
  EXPECT_EQ(value("can_state"), static_cast<double>(CanState::kBusOff));
}

TEST_F(CanPair, SurvivesRandomDatagrams) {
  constexpr unsigned kSeed = 20;
  std::mt19937 random(kSeed);
  std::printf("seed %u\n", kSeed);
  std::uint64_t data_frames = 0, given = 0;
  for (int i = 0; i < 100'000; ++i) {
    std::uint8_t bytes[96];
    for (std::uint8_t& x : bytes) x = static_cast<std::uint8_t>(random());
    const bool usual = random() % 2;
    const std::size_t size = usual ? sizeof(can_frame) : random() % sizeof bytes;
    if (random() % 4 == 0) bytes[3] = 0;  // plausible identifiers now and then
    if (random() % 4 == 0) bytes[1] &= 0x07, bytes[2] = 0;
    if (random() % 2) bytes[4] %= 10;
    ASSERT_TRUE(send_raw(b->descriptor(), bytes, size));
    ++given;
    const auto r = a->try_receive();
    ASSERT_TRUE(r.ok());
    if (!r.value()) continue;
    ++data_frames;
    ASSERT_LE(r.value()->id, 0x7FF);
    ASSERT_LE(r.value()->length, 8);
    ASSERT_EQ(size, sizeof(can_frame));
  }
  const CanCounters c = a->counters();
  EXPECT_GT(data_frames, 100u);
  EXPECT_GT(c.error_frames, 100u);
  EXPECT_EQ(c.received, data_frames);
  EXPECT_EQ(c.received + c.foreign + c.error_frames, given);
}

}  // namespace
}  // namespace tankrig
