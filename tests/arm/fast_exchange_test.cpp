// The exchange that carries the swept joint every time and the others in turn: what it costs the bus, and that nothing
// is lost by it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <vector>

#include "drivers/can/can_timing.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/machine_witness.hpp"

namespace tankrig::sim {
namespace {

using testing_support::ArmBench;
using testing_support::elbow;
using testing_support::Wire;
using namespace std::chrono_literals;

int slots_of(const ArmExchange& exchange) {
  return std::popcount(exchange.demands) + std::popcount(exchange.sensors) + (exchange.master ? 1 : 0);
}

TEST(ExchangeSchedule, ComesRoundToEverythingWithThreeSlotsAtATime) {
  for (int fast = 0; fast < kJoints; ++fast) {
    ExchangeSchedule sut(static_cast<Joint>(fast));
    std::array<int, kJoints> demands{}, sensors{};
    int masters = 0;
    ArmExchange before{0, 0, false};
    for (int i = 0; i < ExchangeSchedule::kFastRound; ++i, sut.advance()) {
      const ArmExchange exchange = sut.next();
      EXPECT_EQ(slots_of(exchange), 3);
      EXPECT_NE(exchange, before) << "an arm that went mute must see another frame";
      before = exchange;
      for (std::size_t j = 0; j < kJoints; ++j) {
        demands[j] += holds(exchange.demands, j);
        sensors[j] += holds(exchange.sensors, j);
      }
      masters += exchange.master;
    }
    EXPECT_NE(sut.next(), before) << "also from round to round";
    for (int j = 0; j < kJoints; ++j) {
      EXPECT_EQ(demands[static_cast<std::size_t>(j)], j == fast ? 9 : 1);
      EXPECT_EQ(sensors[static_cast<std::size_t>(j)], j == fast ? 9 : 1);
    }
    EXPECT_EQ(masters, 1);
  }
}

TEST(ExchangeSchedule, IsWholeWithoutAFastJointAndWhereAsked) {
  ExchangeSchedule whole;
  EXPECT_TRUE(whole.next().whole());
  EXPECT_EQ(slots_of(whole.next()), 11);
  ExchangeSchedule fast(kElbow);
  const ArmExchange due = fast.next();
  fast.begin_whole();
  EXPECT_TRUE(fast.next().whole());
  fast.advance();
  EXPECT_EQ(fast.next(), due) << "nobody loses his turn";
}

TEST(FastExchange, FitsAThousandTimesASecondIntoOneMegabit) {
  Arm5eSettings settings;
  settings.fast_joint = kElbow;
  settings.can.bitrate = 1'000'000;
  settings.exchange_rate_hz = 1000;
  EXPECT_NEAR(carrier_load(settings).load, 0.405, 1e-12);  // three frames of 135 bits at worst
  EXPECT_NO_THROW(check_carrier_load(settings));
  settings.fast_joint.reset();
  EXPECT_NEAR(carrier_load(settings).load, 1.435, 1e-12);
}

/// On a hub, which takes a wire's time for every frame, with somebody who listens.
struct HubBench : ArmBench {
  CanHubSettings bus;
  std::unique_ptr<CanHub> hub;
  std::unique_ptr<CanBus> listener;
  std::vector<CanFrame> heard;

  explicit HubBench(double rate_hz) {
    settings.fast_joint = kElbow;
    settings.exchange_rate_hz = rate_hz;
    settings.can.bitrate = bus.bitrate = parameters.can_bitrate = 1'000'000;
    parameters.can_paced = false;
    bus.path = folder.path() / "bus";
    hub = std::make_unique<CanHub>(bus);
    emulator = std::make_unique<ArmEmulator>(model, parameters, clock);
    CanSettings device;
    device.interface = settings.can.interface = "unix:" + bus.path.string();
    emulator->serve(open_can(device, clock));
    listener = open_can(device, clock);
    arm = open_arm5e(settings, model, clock);
    arm->set_zero({emulator->true_zero(), "by truth"});
  }

  /// Reads and commands at the exchange's rate until `states` have come.
  void run(int states, const JointVector& velocity) {
    const Stamp end = clock.now() + 20s;
    for (Stamp next = clock.now(); states > 0 && clock.now() < end;) {
      clock.sleep_until(next = next + arm->exchange_period());
      const auto news = arm->try_read();
      ASSERT_TRUE(news.ok()) << news.error().where;
      states -= news.value().has_value();
      ASSERT_TRUE(drive(*arm, velocity).ok());
      listen();
    }
    ASSERT_LE(states, 0);
  }
  void listen() {
    for (auto frame = listener->try_receive(); frame.ok() && frame.value(); frame = listener->try_receive())
      heard.push_back(*frame.value());
  }
};

TEST(FastExchange, TakesThreeFramesOnTheBus) {
  HubBench bench(1000);
  bench.run(50, elbow(0.1));  // gains and first readings
  bench.heard.clear();
  const double before = bench.statistic("exchanges"), timeouts = bench.statistic("timeouts");
  const tankrig::testing_support::MachineWitness witness;
  bench.run(300, elbow(0.1));
  const double late = bench.statistic("timeouts") - timeouts, exchanges = bench.statistic("exchanges") - before;
  TANKRIG_SKIP_IF_LATE(witness, bench.settings.reply_timeout / 4);  // three threads carry an answer
  EXPECT_EQ(late, 0);
  ASSERT_GT(exchanges, 0);
  std::int64_t bits = 0;
  for (const CanFrame& frame : bench.heard) {
    can_frame raw{};
    raw.can_id = frame.id;
    raw.can_dlc = frame.length;
    std::copy(frame.data.begin(), frame.data.end(), raw.data);
    bits += frame_bits(raw);
  }
  // One exchange may be on its way at either end.
  EXPECT_LE(static_cast<double>(bench.heard.size()), 3 * (exchanges + 1));
  EXPECT_GE(static_cast<double>(bench.heard.size()), 3 * (exchanges - 1));
  const double per_exchange = static_cast<double>(bits) / exchanges;
  EXPECT_LT(per_exchange, 405 * (exchanges + 1) / exchanges);
  std::printf("%.0f exchanges, %zu frames, %.1f bits each exchange: %.1f %% of 1 Mbit/s at 1 kHz\n", exchanges,
              bench.heard.size(), per_exchange, per_exchange / 10);
}

TEST(FastExchange, BringsTheOtherJointsWithinNine) {
  ArmBench bench(Wire::kFastPair);
  bench.make();
  int states = 0;
  Duration oldest{0}, elbows{0};
  ASSERT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    if (!news.ok() || !news.value()) return false;
    for (const Duration age : news.value()->age) oldest = std::max(oldest, age);
    elbows = std::max(elbows, news.value()->age[kElbow]);
    return ++states >= 60;
  }));
  EXPECT_EQ(elbows.count(), 0) << "the stamp is the fast joint's";
  // Somewhere in a round the master and the others' demands come between: at least eight exchanges of 5 ms.
  EXPECT_GE(oldest, 8 * 4ms);
}

TEST(FastExchange, MovesTheOtherJointsToo) {
  ArmBench bench(Wire::kFastPair);
  bench.make();
  const JointState begin = bench.state();
  JointVector velocity = JointVector::Zero();
  velocity[kShoulder] = 0.1;
  velocity[kSlew] = 0.1;
  JointState state = begin;
  const tankrig::testing_support::MachineWitness witness;
  ASSERT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    (void)drive(*bench.arm, velocity);
    if (news.ok() && news.value()) state = *news.value();
    return state.q[kShoulder] > begin.q[kShoulder] + 0.05 && state.q[kSlew] > begin.q[kSlew] + 0.05;
  })) << state.q.transpose();
  EXPECT_NEAR(state.q[kElbow], begin.q[kElbow], 1e-3);
  TANKRIG_SKIP_IF_LATE(witness, 10ms);  // in five readings of 225 ms, at either end
  for (const Joint joint : {kShoulder, kSlew}) {
    const double truth = bench.emulator->true_velocity_at(state.stamp - state.age[joint])[joint];
    EXPECT_NEAR(truth, 0.1, 0.01) << joint;
    EXPECT_NEAR(state.velocity[joint], truth, 0.01) << joint;
  }
}

/// Stops while shoulder and elbow move, and listens.
TEST(FastExchange, StopsEveryJointAtOnce) {
  HubBench bench(200);
  JointVector velocity = elbow(0.1);
  velocity[kShoulder] = 0.1;
  bench.run(30, velocity);
  bench.heard.clear();
  ASSERT_TRUE(bench.arm->stop().ok());
  std::vector<std::uint16_t> stopped;  // what the exchange before left on the bus is no rest of a whole request
  EXPECT_TRUE(bench.until([&] {
    bench.listen();
    stopped.clear();
    for (const CanFrame& frame : bench.heard)
      if (frame.id >= 0x201 && frame.id <= 0x205 && frame.data[0] == 0 && frame.data[7] == 0)
        stopped.push_back(frame.id);
    return stopped == std::vector<std::uint16_t>{0x201, 0x202, 0x203, 0x204, 0x205};
  })) << ::testing::PrintToString(stopped);
  EXPECT_TRUE(
      bench.until([&] { return bench.emulator->true_velocity_at(bench.clock.now()).cwiseAbs().maxCoeff() == 0; }));
}

TEST(FastExchange, MissesAJointThatIsNeverAnsweredThoughTheFastOneIs) {
  ArmBench bench(Wire::kFastPair);
  bench.make();
  bench.state();
  bench.emulator->set_faults({.truncated = true});  // the jaw's slot never comes
  int states = 0;
  Error error;
  ASSERT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    if (!news.ok()) error = news.error();
    states += news.ok() && news.value();
    return !news.ok();
  }));
  EXPECT_STREQ(error.where, "arm: silent");
  EXPECT_GT(states, 3) << "the fast joint was heard of meanwhile";
}

TEST(FastExchange, NoticesPowerLostDuringASilence) {
  ArmBench bench(Wire::kFastPair);
  bench.parameters.power_up_ticks.fill(700);  // too near to 0 to be a jump
  bench.make();
  bench.state();
  bench.emulator->set_faults({.silent = true});
  EXPECT_STREQ(bench.error().where, "arm: silent");
  bench.emulator->power_cycle();
  bench.emulator->set_faults({});
  EXPECT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    return !news.ok() && news.error().code == ErrorCode::kNotReady;
  }));
  EXPECT_FALSE(bench.arm->homed());
}

TEST(FastExchange, IsTheEncodersSpanAtOneKilohertzToo) {
  EncoderTrack track;
  Stamp now{};
  for (int i = 0; i < 100; ++i) track.take(static_cast<std::uint16_t>(1000 + i / 3), now = now + 1ms);  // 333 ticks/s
  EXPECT_NEAR(track.speed(), 333, 26);  // one tick in 40 ms
}

}  // namespace
}  // namespace tankrig::sim
