// What lies in the queue of a bus that takes no frames, and so comes late: one exchange and, last, rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "drivers/arm/can_arm_link.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

ArmDemands demands(DemandType type, std::uint16_t speed) {
  ArmDemands all;
  all.fill({type, speed, 0x0FFF, 0x0FFF});
  return all;
}

/// A host, and the other end of its bus, which takes frames only when it is asked to.
struct StuckBus {
  MonotonicClock clock;
  std::unique_ptr<CanBus> far;
  std::optional<CanArmLink> link;

  StuckBus() {
    auto [near, other] = make_can_pair(clock);
    far = std::move(other);
    link.emplace(std::move(near), ArmCanIds{}, 500'000);
  }
  Status move(std::uint16_t speed) {
    return link->try_send(demands(DemandType::kSpeedForward, speed), {}, clock.now());
  }
  Status rest() { return link->try_send(demands(DemandType::kStop, 0), {}, clock.now()); }

  /// Everything that comes late, in order: the demand of each frame.
  std::vector<DemandSlot> late() {
    std::vector<DemandSlot> all;
    while (true) {
      const auto frame = far->try_receive();
      if (!frame.ok() || !frame.value()) return all;
      all.push_back(decode_demand(frame.value()->data));
    }
  }
};

TEST(StaleDemands, OneExchangeAndLastRestIsAllThatWaits) {
  StuckBus bus;
  EXPECT_TRUE(bus.move(100).ok());
  for (int i = 0; i < 50; ++i) {
    bus.link->forget();  // given up
    EXPECT_EQ(bus.move(200).error().code, ErrorCode::kRefused);
    EXPECT_EQ(bus.link->try_send(PidSlot{}, bus.clock.now()).error().code, ErrorCode::kRefused);
    EXPECT_TRUE(bus.rest().ok());
  }
  const std::vector<DemandSlot> late = bus.late();
  ASSERT_EQ(late.size(), 2U * kJoints);
  for (int i = 0; i < kJoints; ++i) {
    EXPECT_EQ(late[i].demand, 100);
    EXPECT_EQ(late[kJoints + i].type, DemandType::kStop);
  }
}

TEST(StaleDemands, MotionGoesOnOnceTheBusTakesFramesAgain) {
  StuckBus bus;
  EXPECT_TRUE(bus.move(100).ok());
  EXPECT_FALSE(bus.move(200).ok());
  (void)bus.late();
  EXPECT_TRUE(bus.move(200).ok());
  EXPECT_EQ(bus.late().size(), static_cast<std::size_t>(kJoints));
}

/// The driver's own way: it is driven, nobody takes its frames, and it ends; the bus comes back afterwards.
TEST(StaleDemands, OfAnEndedDriverEndWithRest) {
  MonotonicClock clock;
  auto [near, far] = make_can_pair(clock);
  Arm5eSettings settings;
  settings.silence_timeout = 100ms;
  {
    Arm5e arm(settings, arm5e(), std::make_unique<CanArmLink>(std::move(near), settings.can_ids, 500'000), clock);
    arm.set_zero({});
    for (const Stamp end = clock.now() + 400ms; clock.now() < end; clock.sleep_until(clock.now() + 5ms)) {
      (void)arm.try_read();
      std::array<int, kJoints> ticks{};
      ticks[kElbow] = 400;
      (void)drive_ticks(arm, ticks);
    }
  }
  std::array<DemandSlot, kJoints> last{};
  int frames = 0;
  while (true) {
    const auto frame = far->try_receive();
    if (!frame.ok() || !frame.value()) break;
    ++frames;
    for (std::size_t j = 0; j < kJoints; ++j)
      if (frame.value()->id == settings.can_ids.demand[j]) last[j] = decode_demand(frame.value()->data);
  }
  EXPECT_GT(frames, 0);
  EXPECT_LE(frames, 2 * kJoints);
  for (const DemandSlot& demand : last) EXPECT_EQ(demand.type, DemandType::kStop);
}

}  // namespace
}  // namespace tankrig
