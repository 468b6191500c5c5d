// What a stop puts on the bus, and what it says, where the send queue cut a request or nobody commands.
#include <gtest/gtest.h>

#include "drivers/arm/arm5e.hpp"
#include "tests/arm/list_bus.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::ListBus;

constexpr std::array<int, kJoints> kElbowMoves{0, 0, 1000, 0, 0}, kElbowCreeps{0, 0, 40, 0, 0};
constexpr auto kFirstThree = std::size_t{3};  // of a request's five frames: the elbow's too

/// The driver under a clock that stands still, on a bus that answers nothing.
struct Bench {
  VirtualClock clock{Stamp{1'000'000'000}};
  Arm5eSettings settings;
  ListBus* bus = nullptr;
  std::unique_ptr<Arm5e> arm;

  Bench() {
    auto list = std::make_unique<ListBus>();
    bus = list.get();
    arm = std::make_unique<Arm5e>(settings, arm5e(),
                                  std::make_unique<CanArmLink>(std::move(list), settings.can_ids, settings.can.bitrate),
                                  clock);
    EXPECT_TRUE(arm->write_ticks({}).ok());  // the gains
    pass();
  }
  /// Until what was asked is given up, and the next request is due.
  void pass(Duration time = 100ms) { clock.sleep_until(clock.now() + time); }

  /// The newest demand of each joint on the bus.
  bool rests() const {
    std::array<std::uint8_t, kJoints> types{};
    for (const CanFrame& frame : bus->sent)
      for (std::size_t j = 0; j < kJoints; ++j)
        if (frame.id == settings.can_ids.demand[j]) types[j] = frame.data[0];
    return types == std::array<std::uint8_t, kJoints>{};
  }
};

TEST(ArmStop, IsRepeatedOnlyWhenAnExchangeIsDue) {
  Bench bench;
  EXPECT_TRUE(bench.arm->stop().ok());
  const std::size_t sent = bench.bus->sent.size();
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_EQ(bench.bus->sent.size(), sent);
  bench.pass();
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_EQ(bench.bus->sent.size(), sent + kJoints);
}

TEST(ArmStop, OfARequestThatTheQueueCutHalfWayIsAtOnceAndNotOkUntilItIsSent) {
  Bench bench;
  EXPECT_TRUE(bench.arm->stop().ok());
  bench.pass();
  bench.bus->room = bench.bus->sent.size() + kFirstThree;
  EXPECT_TRUE(bench.arm->write_ticks(kElbowMoves).ok()) << "a full queue is no error of a set-point";
  ASSERT_FALSE(bench.rests());
  const Status refused = bench.arm->stop();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  bench.bus->room = 1000;
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_TRUE(bench.rests());
}

TEST(ArmStop, OfTheWatchdogAlsoEndsTheSlowestDemand) {
  Bench bench;
  EXPECT_TRUE(bench.arm->write_ticks(kElbowCreeps).ok());
  ASSERT_FALSE(bench.rests());
  bench.pass(bench.settings.watchdog + 1ms);
  (void)bench.arm->try_read();
  EXPECT_TRUE(bench.rests());
}

}  // namespace
}  // namespace tankrig
