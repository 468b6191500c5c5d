#include "drivers/arm/can_arm_link.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/can/can_timing.hpp"
#include "tests/arm/list_bus.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::ListBus;

struct LinkBench {
  static constexpr int kBitrate = 500'000;
  ListBus* bus = nullptr;
  CanArmLink link;

  explicit LinkBench(Duration latency = {}) : LinkBench(std::make_unique<ListBus>(), latency) {}

  void receive(std::uint16_t id, std::vector<std::uint8_t> bytes, Stamp stamp = {}) {
    CanFrame frame;
    frame.id = id;
    frame.length = static_cast<std::uint8_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), frame.data.begin());
    frame.stamp = stamp;
    bus->waiting.push_back(frame);
  }
  std::optional<ArmAnswer> answer() { return link.try_receive({}).value(); }

 private:
  LinkBench(std::unique_ptr<ListBus> owned, Duration latency)
      : bus(owned.get()), link(std::move(owned), ArmCanIds{}, kBitrate, latency) {}
};

Duration time_of(std::uint16_t id, const std::vector<std::uint8_t>& bytes) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data);
  return bits_duration(frame_bits(frame), LinkBench::kBitrate);
}

TEST(CanArmLink, SendsFiveSlotsUnderTheirIdentifiers) {
  LinkBench bench;
  ArmDemands demands;
  demands[kElbow] = {DemandType::kSpeedForward, 0x0123, 0x0FFF, 0x00FF};
  ASSERT_TRUE(bench.link.try_send(demands, {}, {}).ok());
  ASSERT_EQ(bench.bus->sent.size(), 5U);
  for (std::uint16_t j = 0; j < 5; ++j) EXPECT_EQ(bench.bus->sent[j].id, 0x201 + j);
  EXPECT_EQ(bench.bus->sent[kElbow].data, (SlotBytes{3, 0x01, 0x23, 0x0F, 0xFF, 0x00, 0xFF, 0}));
  EXPECT_EQ(bench.link.outstanding(), 1);
  ASSERT_TRUE(bench.link.try_send(PidSlot{{1, 2, 3}, {4, 5, 6}}, {}).ok());
  EXPECT_EQ(bench.bus->sent[5].id, 0x211);
  EXPECT_EQ(bench.bus->sent[9].data, (SlotBytes{1, 2, 3, 4, 5, 6, 0, 0}));
}

TEST(CanArmLink, TakesTheMomentOfReadingFromTheLeastDelayedFrame) {
  LinkBench bench(3ms);
  const Stamp read{1'000'000'000};
  Stamp when = read + 3ms;
  const std::vector<std::uint8_t> master{1, 2, 3};
  when = when + time_of(0x180, master);
  bench.receive(0x180, master, when + 700us);  // delayed on the way
  for (std::uint16_t j = 0; j < 5; ++j) {
    const std::vector<std::uint8_t> slot{static_cast<std::uint8_t>(j), 0xFF, 0, 0, 0, 0, 0, 0};
    when = when + time_of(static_cast<std::uint16_t>(0x181 + j), slot);
    bench.receive(static_cast<std::uint16_t>(0x181 + j), slot, when + (j == 2 ? 0us : 400us));
  }
  const auto answer = bench.answer();
  ASSERT_TRUE(answer && answer->sensors);
  EXPECT_EQ(answer->read, read);
  EXPECT_EQ(answer->master, (MasterBytes{1, 2, 3}));
  for (std::size_t j = 0; j < kJoints; ++j) EXPECT_EQ(answer->joints[j].position, 0xFF00 + j);
}

TEST(CanArmLink, WantsEveryJointInAnyOrderAndCountsWhatIsMissing) {
  LinkBench bench;
  for (const std::uint16_t id : {0x183, 0x181, 0x185, 0x184, 0x181}) bench.receive(id, std::vector<std::uint8_t>(8));
  EXPECT_FALSE(bench.answer());
  EXPECT_EQ(bench.link.counters().incomplete, 1U);  // 0x181 again: the answer before had no 0x182
  for (const std::uint16_t id : {0x185, 0x184, 0x183, 0x182}) bench.receive(id, std::vector<std::uint8_t>(8));
  EXPECT_TRUE(bench.answer());
}

TEST(CanArmLink, SaysWhetherTheMastersBytesCameWithTheAnswer) {
  LinkBench bench;
  for (const bool master : {true, false, true}) {
    ASSERT_TRUE(bench.link.try_send(ArmDemands{}, {}, {}).ok());
    if (master) bench.receive(0x180, {1, 2, 3});
    for (const std::uint16_t id : {0x181, 0x182, 0x183, 0x184, 0x185}) bench.receive(id, std::vector<std::uint8_t>(8));
    const auto answer = bench.answer();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->has.master, master);
    EXPECT_EQ(answer->has.sensors, kEveryJoint);
    EXPECT_EQ(answer->master, (MasterBytes{1, 2, 3}));
  }
}

TEST(CanArmLink, TakesEchoesOfTheGainsAsAnAnswerWithoutSensors) {
  LinkBench bench;
  for (std::uint16_t id = 0x191; id <= 0x195; ++id) bench.receive(id, std::vector<std::uint8_t>(8));
  const auto answer = bench.answer();
  ASSERT_TRUE(answer);
  EXPECT_FALSE(answer->sensors);
}

TEST(CanArmLink, RefusesTheExchangeWhenTheQueueIsFull) {
  LinkBench bench;
  bench.bus->room = 3;
  EXPECT_EQ(bench.link.try_send(ArmDemands{}, {}, {}).error().code, ErrorCode::kRefused);
  EXPECT_EQ(bench.link.counters().send_buffer_full, 1U);
  EXPECT_EQ(bench.link.outstanding(), 0);
}

// Another joint's demand goes before the fast one's, whose last byte asks: 0x80 at once, a bit per joint, 0x20 the
// master.
TEST(CanArmLink, SendsAFastExchangeWithTheQuestionInItsLastFrame) {
  LinkBench bench;
  ArmDemands demands;
  demands[kElbow] = {DemandType::kSpeedForward, 0x0123, 0x0FFF, 0x00FF};
  ASSERT_TRUE(bench.link.try_send(demands, {only(kElbow) | only(kJawRotate), only(kElbow), false}, {}).ok());
  ASSERT_EQ(bench.bus->sent.size(), 2U);
  EXPECT_EQ(bench.bus->sent[0].id, 0x204);
  EXPECT_EQ(bench.bus->sent[0].data[7], 0x80);
  EXPECT_EQ(bench.bus->sent[1].id, 0x203);
  EXPECT_EQ(bench.bus->sent[1].data, (SlotBytes{3, 0x01, 0x23, 0x0F, 0xFF, 0x00, 0xFF, 0x84}));
  ASSERT_TRUE(bench.link.try_send(demands, {only(kElbow), only(kElbow) | only(kSlew), true}, {}).ok());
  ASSERT_EQ(bench.bus->sent.size(), 3U);
  EXPECT_EQ(bench.bus->sent[2].data[7], 0x80 | 0x20 | 0x04 | 0x01);
}

TEST(CanArmLink, TakesWhatAFastExchangeAskedForAndSaysSo) {
  LinkBench bench;
  const ArmExchange asked{only(kElbow), only(kElbow) | only(kSlew), true};
  ASSERT_TRUE(bench.link.try_send(ArmDemands{}, asked, {}).ok());
  bench.receive(0x180, {1, 2, 3});
  bench.receive(0x183, {7, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(bench.answer());
  bench.receive(0x181, {5, 0, 0, 0, 0, 0, 0, 0});
  const auto answer = bench.answer();
  ASSERT_TRUE(answer && answer->sensors);
  EXPECT_EQ(answer->has, asked);
  EXPECT_EQ(answer->joints[kElbow].position, 7);
  EXPECT_EQ(answer->joints[kSlew].position, 5);
  EXPECT_EQ(answer->master, (MasterBytes{1, 2, 3}));
  EXPECT_EQ(bench.link.outstanding(), 0);
}

TEST(CanArmLink, KeepsAWholeRequestThatOvertookAFastOneApart) {
  LinkBench bench;
  const ArmExchange fast{only(kElbow), only(kElbow), false};
  ASSERT_TRUE(bench.link.try_send(ArmDemands{}, fast, {}).ok());
  ASSERT_TRUE(bench.link.try_send(ArmDemands{}, {}, {}).ok());  // a stop
  bench.receive(0x183, std::vector<std::uint8_t>(8));
  const auto first = bench.answer();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->has, fast);
  bench.receive(0x180, {1, 2, 3});
  for (const std::uint16_t id : {0x181, 0x182, 0x183, 0x184, 0x185}) bench.receive(id, std::vector<std::uint8_t>(8));
  const auto second = bench.answer();
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->has.whole());
  EXPECT_EQ(bench.link.counters().incomplete, 0U);
}

TEST(CanArmLink, DoesNotStampAnAnswerWithTheLeftoversOfOneForgotten) {
  LinkBench bench;
  ASSERT_TRUE(bench.link.try_send(ArmDemands{}, {only(kElbow), only(kElbow) | only(kSlew), false}, {}).ok());
  bench.receive(0x183, std::vector<std::uint8_t>(8), Stamp{1'000'000});
  EXPECT_FALSE(bench.answer());
  bench.link.forget();
  bench.receive(0x181, std::vector<std::uint8_t>(8), Stamp{2'000'000});  // late
  EXPECT_FALSE(bench.answer());
  ASSERT_TRUE(bench.link.try_send(ArmDemands{}, {only(kElbow), only(kElbow) | only(kSlew), false}, {}).ok());
  const std::vector<std::uint8_t> slot(8);
  bench.receive(0x183, slot, Stamp{50'000'000});
  bench.receive(0x181, slot, Stamp{50'000'000} + time_of(0x181, slot));
  const auto answer = bench.answer();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->read, Stamp{50'000'000} - time_of(0x183, slot));
  EXPECT_EQ(bench.link.counters().incomplete, 2U);
}

TEST(CanArmLink, AccountsForEveryFrameOfRandomTraffic) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  LinkBench bench;
  std::uint64_t wrong_ids = 0, wrong_lengths = 0, whole = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto id = static_cast<std::uint16_t>(random() % 3 == 0 ? random() & 0x7FF : 0x180 + random() % 0x30);
    const bool master = id == 0x180;
    const bool ours =
        master || (id >= 0x181 && id <= 0x185) || (id >= 0x191 && id <= 0x195) || (id >= 0x1A1 && id <= 0x1A5);
    std::vector<std::uint8_t> bytes(random() % 4 == 0 ? random() % 9 : (master ? 3 : 8));
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
    wrong_ids += !ours;
    wrong_lengths += ours && bytes.size() != (master ? 3U : 8U);
    bench.receive(id, bytes, Stamp{i * 100'000LL});
    while (bench.answer()) ++whole;
    if (random() % 100 == 0) bench.link.forget();
  }
  const ArmLinkCounters c = bench.link.counters();
  EXPECT_EQ(c.wrong_ids, wrong_ids) << "seed " << kSeed;
  EXPECT_EQ(c.wrong_lengths, wrong_lengths) << "seed " << kSeed;
  EXPECT_EQ(c.answers, whole);
  EXPECT_GT(whole, 500U);
}

}  // namespace
}  // namespace tankrig
