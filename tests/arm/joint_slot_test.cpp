#include "drivers/arm/joint_slot.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

constexpr unsigned kSlotSeed = 20260131;

TEST(JointSlot, DemandsAreBigEndian) {
  const DemandSlot slot{DemandType::kSpeedBackward, 0x0123, 0x0FFE, 0x00FF};
  EXPECT_EQ(encode(slot), (SlotBytes{4, 0x01, 0x23, 0x0F, 0xFE, 0x00, 0xFF, 0}));
  EXPECT_EQ(decode_demand(encode(slot)), slot);
}

TEST(JointSlot, SensorsAreLittleEndian) {
  const SensorSlot slot = decode_sensors({0x34, 0x12, 0x0C, 0xFE, 0xC8, 0x0E, 0x07, 0x01});
  EXPECT_EQ(slot.position, 0x1234);
  EXPECT_EQ(static_cast<std::int16_t>(slot.speed), -500);
  EXPECT_EQ(slot.water_ingress, 0xC8);
  EXPECT_EQ(slot.temperature, 0x0E);
  EXPECT_EQ(slot.tail, 0x0107);
  EXPECT_EQ(encode(slot), (SlotBytes{0x34, 0x12, 0x0C, 0xFE, 0xC8, 0x0E, 0x07, 0x01}));
}

TEST(JointSlot, GainsArePositionThenSpeed) {
  const PidSlot gains{{1, 2, 3}, {255, 4, 0}};
  EXPECT_EQ(encode(gains), (SlotBytes{1, 2, 3, 255, 4, 0, 0, 0}));
}

TEST(JointSlot, NeverSendsADemandWhoseLowByteIsTen) {
  for (int demand = 0; demand <= 0xFFFF; ++demand) {
    const SlotBytes bytes = encode(DemandSlot{DemandType::kSpeedForward, static_cast<std::uint16_t>(demand), 0, 0});
    ASSERT_NE(bytes[2], 0x0A) << demand;
    const int expected = (demand & 0xFF) == 0x0A ? demand + 1 : demand;
    ASSERT_EQ(bytes[1] << 8 | bytes[2], expected);
  }
}

TEST(JointSlot, LimitsMayContainTen) {
  EXPECT_EQ(encode(DemandSlot{DemandType::kStop, 0, 0x010A, 0x0A0A}), (SlotBytes{0, 0, 0, 0x01, 0x0A, 0x0A, 0x0A, 0}));
}

TEST(JointSlot, ComesBackAsItWentForAnyContent) {
  RecordProperty("seed", static_cast<int>(kSlotSeed));
  std::mt19937 random(kSlotSeed);
  for (int i = 0; i < 200'000; ++i) {
    SlotBytes bytes;
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
    ASSERT_EQ(encode(decode_sensors(bytes)), bytes) << "seed " << kSlotSeed;
    SlotBytes demand = bytes;
    demand[7] = 0;
    if (demand[2] == 0x0A) demand[2] = 0x0B;
    ASSERT_EQ(encode(decode_demand(demand)), demand) << "seed " << kSlotSeed;
  }
}

// Values of the public sources: raw 113 is about 24 V; 0.094 A, 1.96 degrees and 0.21 V per count.
TEST(ArmScaling, FollowsThePublicConstants) {
  const ArmScaling a = laboratory_scaling(), b = micro_scaling();
  EXPECT_NEAR(a.volts(113), 24.0, 0.05);
  EXPECT_DOUBLE_EQ(a.amperes(0), -0.2);
  EXPECT_NEAR(a.amperes(100), 100.0 / 511 * 3.3 / (39.0 / 59.0) / 0.625 * 6 - 0.2, 1e-12);
  EXPECT_NEAR(a.celsius(100), 100.0 / 255 * 3.3 / 0.00661017, 1e-9);
  EXPECT_NEAR(a.ampere_per_count, b.ampere_per_count, 0.0005);
  EXPECT_NEAR(a.celsius_per_count, b.celsius_per_count, 0.005);
  EXPECT_NEAR(a.volt_per_count, b.volt_per_count, 0.005);
}

}  // namespace
}  // namespace tankrig
