// Bits on the wire against a second, slow counting of them, and against published bounds.
#include "drivers/can/can_timing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/can/can_support.hpp"

namespace tankrig {
namespace {

using namespace can_test;

std::string binary(std::uint32_t value, int digits) {
  std::string text;
  for (int i = digits - 1; i >= 0; --i) text += value >> i & 1 ? '1' : '0';
  return text;
}

/// Remainder of the message, fifteen zeros behind it, by x^15+x^14+x^10+x^8+x^7+x^4+x^3+1: long division on text.
std::string remainder_by_division(std::string message) {
  const std::string divisor = "1100010110011001";
  message += std::string(15, '0');
  for (std::size_t i = 0; i + 15 < message.size(); ++i)
    if (message[i] == '1')
      for (std::size_t k = 0; k < divisor.size(); ++k) message[i + k] = message[i + k] == divisor[k] ? '0' : '1';
  return message.substr(message.size() - 15);
}

std::string stuffed(const std::string& plain) {
  std::string wire;
  for (const char bit : plain) {
    wire += bit;
    if (wire.size() >= 5 && wire.substr(wire.size() - 5) == std::string(5, bit)) wire += bit == '0' ? '1' : '0';
  }
  return wire;
}

int slow_bits(const can_frame& f) {
  const int bytes = f.can_id & CAN_RTR_FLAG ? 0 : f.can_dlc;
  std::string plain = "0";
  if (f.can_id & CAN_EFF_FLAG)
    plain += binary((f.can_id & CAN_EFF_MASK) >> 18, 11) + "11" + binary(f.can_id & 0x3FFFF, 18) +
             (f.can_id & CAN_RTR_FLAG ? "1" : "0") + "00";
  else
    plain += binary(f.can_id & CAN_SFF_MASK, 11) + (f.can_id & CAN_RTR_FLAG ? "1" : "0") + "00";
  plain += binary(f.can_dlc, 4);
  for (int i = 0; i < bytes; ++i) plain += binary(f.data[i], 8);
  plain += remainder_by_division(plain);
  return static_cast<int>(stuffed(plain).size()) + 13;
}

can_frame random_frame(std::mt19937& random, bool extended) {
  can_frame f{};
  f.can_id = extended ? (random() & CAN_EFF_MASK) | CAN_EFF_FLAG : random() & CAN_SFF_MASK;
  f.can_dlc = random() % 9;
  const int kind = random() % 4;  // runs of equal bits make stuff bits
  for (int i = 0; i < f.can_dlc; ++i)
    f.data[i] = kind == 0 ? 0 : kind == 1 ? 0xFF : kind == 2 ? (random() % 2 ? 0x0F : 0xF0) : random();
  return f;
}

TEST(CanTiming, CountsTheBitsThatASlowEncoderWrites) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  std::printf("seed %u\n", kSeed);
  for (int i = 0; i < 20'000; ++i) {
    can_frame f = random_frame(random, i % 2);
    if (random() % 8 == 0) f.can_id |= CAN_RTR_FLAG;
    ASSERT_EQ(frame_bits(f), slow_bits(f)) << std::hex << f.can_id << " length " << int(f.can_dlc);
  }
}

TEST(CanTiming, StaysWithinThePublishedBounds) {
  constexpr unsigned kSeed = 4;
  std::mt19937 random(kSeed);
  std::printf("seed %u\n", kSeed);
  for (int i = 0; i < 50'000; ++i) {
    const bool extended = i % 2;
    const can_frame f = random_frame(random, extended);
    ASSERT_LE(frame_bits(f), worst_frame_bits(f.can_dlc, extended));
    ASSERT_GE(frame_bits(f), (extended ? 67 : 47) + 8 * f.can_dlc);
  }
}

TEST(CanTiming, WorstCaseIsTheOneOfTheSchedulabilityPaper) {
  // Davis, Burns, Bril, Lukkien 2007, equations 1 and 2: (55 + 10 s) and (80 + 10 s) bits.
  for (int s = 0; s <= 8; ++s) {
    EXPECT_EQ(worst_frame_bits(s), 55 + 10 * s);
    EXPECT_EQ(worst_frame_bits(s, true), 80 + 10 * s);
  }
}

TEST(CanTiming, DurationsRoundUp) {
  EXPECT_EQ(bits_duration(135, 1'000'000), std::chrono::microseconds(135));
  EXPECT_EQ(bits_duration(135, 500'000), std::chrono::microseconds(270));
  EXPECT_EQ(bits_duration(1, 300'000).count(), 3334);
}

TEST(CanTiming, LoadIsTheShareOfTheBus) {
  const CanTraffic traffic[] = {{1000, 8}, {100, 0}};
  EXPECT_DOUBLE_EQ(bus_load(traffic, 500'000), (1000 * 135 + 100 * 55) / 500'000.0);
  EXPECT_EQ(bus_load({}, 500'000), 0);
}

}  // namespace
}  // namespace tankrig
