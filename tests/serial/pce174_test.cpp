#include "drivers/lux/pce174.hpp"

#include <gmock/gmock.h>

#include <random>
#include <vector>

#include "sim_backends/wire/lux_emulator.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

/// 14.6 lux in the 400 lux range on 2019-03-10, Sunday, 17:18:32, six records stored, cursor at 1: the example reading
/// of philpagel/PCE174-communication README.md, laid out by its protocol.md.
Bytes published() {
  return {0xAA, 0xDD, 0x00, 0x19, 0x07, 0x03, 0x10, 0x17, 0x18, 0x32, 1, 46, 1, 46, 0x81, 0x08, 6, 1};
}

Bytes with(std::size_t position, std::uint8_t byte) {
  Bytes bytes = published();
  bytes[position] = byte;
  return bytes;
}

Bytes showing(int counts, std::uint8_t stat0, std::uint8_t stat1 = 0) {
  Bytes bytes = published();
  bytes[10] = bytes[12] = static_cast<std::uint8_t>(counts / 100);
  bytes[11] = bytes[13] = static_cast<std::uint8_t>(counts % 100);
  bytes[14] = stat0;
  bytes[15] = stat1;
  return bytes;
}

TEST(Pce174Protocol, AsksWithThreeBytes) { EXPECT_THAT(kPce174LiveRequest, ::testing::ElementsAre(0x87, 0x83, 0x11)); }

TEST(Pce174Protocol, DecodesThePublishedExample) {
  const auto live = decode_pce174_live(published());
  ASSERT_TRUE(live.ok()) << live.error().where;
  const Pce174Live& l = live.value();
  EXPECT_DOUBLE_EQ(l.value, 14.6);
  EXPECT_DOUBLE_EQ(l.lux(), 14.6);
  EXPECT_EQ(l.unit, LuxUnit::kLux);
  EXPECT_EQ(l.mode, Pce174Mode::kNormal);
  EXPECT_FALSE(l.hold);
  EXPECT_FALSE(l.low_battery);
  EXPECT_EQ(l.memory, Pce174Memory::kNone);
}

TEST(Pce174Protocol, KnowsEveryRangeInBothUnits) {
  struct Case {
    std::uint8_t stat0;
    double factor;
    LuxUnit unit;
  };
  const Case cases[] = {{0x80, 100, LuxUnit::kLux},        {0x81, 0.1, LuxUnit::kLux},
                        {0x82, 1, LuxUnit::kLux},          {0x83, 10, LuxUnit::kLux},
                        {0x84, 10, LuxUnit::kFootCandle},  {0x85, 0.01, LuxUnit::kFootCandle},
                        {0x86, 0.1, LuxUnit::kFootCandle}, {0x87, 1, LuxUnit::kFootCandle}};
  for (const Case& c : cases) {
    const auto live = decode_pce174_live(showing(1234, c.stat0));
    ASSERT_TRUE(live.ok());
    EXPECT_DOUBLE_EQ(live.value().value, 1234 * c.factor);
    EXPECT_EQ(live.value().unit, c.unit);
    const double lux = c.unit == LuxUnit::kLux ? 1 : 10.763910416709722;
    EXPECT_DOUBLE_EQ(live.value().lux(), 1234 * c.factor * lux);
  }
}

TEST(Pce174Protocol, KnowsHoldBatteryAndModes) {
  EXPECT_TRUE(decode_pce174_live(with(14, 0xC1)).value().hold);
  EXPECT_TRUE(decode_pce174_live(with(15, 0x20)).value().low_battery);
  EXPECT_EQ(decode_pce174_live(with(15, 0x02)).value().memory, Pce174Memory::kRecall);
  const std::pair<int, Pce174Mode> modes[] = {{2, Pce174Mode::kPeakMin},
                                              {3, Pce174Mode::kPeakMax},
                                              {4, Pce174Mode::kMax},
                                              {5, Pce174Mode::kMin},
                                              {6, Pce174Mode::kRelative}};
  for (const auto& [bits, mode] : modes)
    EXPECT_EQ(decode_pce174_live(with(14, static_cast<std::uint8_t>(0x81 | bits << 3))).value().mode, mode);
}

TEST(Pce174Protocol, KnowsTheSignOfARelativeReading) {
  Bytes bytes = showing(55, 0x80 | 6 << 3 | 1, 0x10);
  bytes[12] = 2;
  bytes[13] = 0;
  const auto live = decode_pce174_live(bytes);
  ASSERT_TRUE(live.ok());
  EXPECT_DOUBLE_EQ(live.value().value, -5.5);
}

TEST(Pce174Protocol, KnowsAnOverloadByTheDisplaysCounts) {
  EXPECT_FALSE(decode_pce174_live(showing(4000, 0x80)).value().overload());
  EXPECT_TRUE(decode_pce174_live(showing(4001, 0x80)).value().overload());
}

TEST(Pce174Protocol, ToleratesTheClockThatTheInstrumentGetsWrong) {
  const auto live = decode_pce174_live(with(9, 0x61));
  ASSERT_TRUE(live.ok());
  EXPECT_DOUBLE_EQ(live.value().value, 14.6);
}

TEST(Pce174Protocol, SaysWhatIsWrongWithAReply) {
  const auto fault = [](const Bytes& bytes) {
    const auto live = decode_pce174_live(bytes);
    EXPECT_EQ(live.error().code, ErrorCode::kProtocol);
    return live.ok() ? std::string("decoded") : std::string(live.error().where);
  };
  Bytes shorter = published(), longer = published();
  shorter.pop_back();
  longer.push_back(0);
  EXPECT_THAT(fault(shorter), HasSubstr("has not 18 bytes"));
  EXPECT_THAT(fault(longer), HasSubstr("has not 18 bytes"));
  EXPECT_THAT(fault({}), HasSubstr("has not 18 bytes"));
  EXPECT_THAT(fault(with(0, 0xAB)), HasSubstr("does not begin with AA DD"));
  EXPECT_THAT(fault(with(1, 0xCC)), HasSubstr("does not begin with AA DD"));
  EXPECT_THAT(fault(with(2, 1)), HasSubstr("reserved byte is not 0"));
  EXPECT_THAT(fault(with(9, 0x1F)), HasSubstr("clock is not decimal"));
  EXPECT_THAT(fault(with(11, 100)), HasSubstr("digits above 99"));
  EXPECT_THAT(fault(with(14, 0x81 | 1 << 3)), HasSubstr("undefined mode"));
  EXPECT_THAT(fault(with(14, 0x81 | 7 << 3)), HasSubstr("undefined mode"));
  EXPECT_THAT(fault(with(15, 0x10)), HasSubstr("negative without relative mode"));
  EXPECT_THAT(fault(with(11, 47)), HasSubstr("value and raw value differ"));
}

TEST(Pce174Protocol, WhateverComesDecodesToAPossibleReadingOrNothing) {
  const unsigned seed = 174;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int decoded = 0;
  for (int i = 0; i < 200000; ++i) {
    Bytes bytes = published();
    if (i % 2 == 0) {
      bytes.resize(random() % 24);
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    } else {
      for (unsigned k = 1 + random() % 3; k > 0; --k)
        bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    }
    const auto live = decode_pce174_live(bytes);
    if (!live.ok()) {
      ASSERT_EQ(live.error().code, ErrorCode::kProtocol);
      continue;
    }
    ++decoded;
    const Pce174Live& l = live.value();
    ASSERT_LE(std::abs(l.value), 9999 * 100.0);
    ASSERT_TRUE(l.value >= 0 || l.mode == Pce174Mode::kRelative);
    ASSERT_DOUBLE_EQ(std::abs(l.value), l.counts * l.resolution);
  }
  EXPECT_GT(decoded, 1000);
}

TEST(Pce174Protocol, ReadsBackWhatTheEmulatorWrites) {
  for (const LuxUnit unit : {LuxUnit::kLux, LuxUnit::kFootCandle}) {
    for (double lux = 0.05; lux < 400e3; lux *= 1.37) {
      const auto live = decode_pce174_live(sim::encode_pce174_live(lux, {.unit = unit}));
      ASSERT_TRUE(live.ok());
      EXPECT_FALSE(live.value().overload());
      EXPECT_NEAR(live.value().value, unit == LuxUnit::kLux ? lux : lux / kLuxPerFootCandle,
                  0.5000001 * live.value().resolution);
    }
  }
  EXPECT_TRUE(decode_pce174_live(sim::encode_pce174_live(500e3, {})).value().overload());
}

}  // namespace
}  // namespace tankrig
