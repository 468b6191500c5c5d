#include "drivers/lux/pce174.hpp"

#include <gmock/gmock.h>

#include <random>
#include <vector>

#include "core/input_error.hpp"
#include "drivers/lux/open_lux_meter.hpp"
#include "sim_backends/wire/lux_emulator.hpp"
#include "tests/serial/count.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using sim::LuxEmulator;
using sim::LuxFault;
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

struct Pce174Meter {
  TemporaryFolder folder;
  std::atomic<double> lux{123.4};
  LuxEmulator emulator{{.kind = sim::LuxMeterKind::kPce174, .name = folder.path() / "lux", .answer_delay = 1ms},
                       [this] { return lux.load(); }};
  Pce174Settings settings{.device = (folder.path() / "lux").string(), .reply_timeout = 3s};
};

TEST(Pce174, ReadsTheLightOverTheWire) {
  Pce174Meter meter;
  Pce174 sut(meter.settings);
  const Stamp before = MonotonicClock{}.now();
  const auto reading = sut.read(20s);
  ASSERT_TRUE(reading.ok()) << reading.error().where;
  EXPECT_DOUBLE_EQ(reading.value().lux, 123.4);
  EXPECT_GE(reading.value().stamp, before);
  EXPECT_LE(reading.value().stamp, MonotonicClock{}.now());
  meter.lux = 87000;
  EXPECT_DOUBLE_EQ(sut.read(20s).value().lux, 87000);
  EXPECT_EQ(count(sut, "replies"), 2);
  EXPECT_EQ(count(sut, "retries"), 0);
  EXPECT_EQ(count(sut, "skipped_bytes"), 0);
}

TEST(Pce174, FindsTheAnswerBehindNoise) {
  Pce174Meter meter;
  meter.emulator.set_fault(LuxFault::kGarbage);
  Pce174 sut(meter.settings);
  const auto reading = sut.read(20s);
  ASSERT_TRUE(reading.ok()) << reading.error().where;
  EXPECT_DOUBLE_EQ(reading.value().lux, 123.4);
  EXPECT_GE(count(sut, "skipped_bytes"), 7);
}

TEST(Pce174, SaysThatTheMeterIsOffWhenNothingAnswers) {
  Pce174Meter meter;
  meter.settings.reply_timeout = 20ms;
  meter.emulator.set_fault(LuxFault::kSilent);
  Pce174 sut(meter.settings);
  const auto reading = sut.read(100ms);
  ASSERT_FALSE(reading.ok());
  EXPECT_EQ(reading.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(reading.error().where, HasSubstr("no answer: switch it on"));
  EXPECT_GE(count(sut, "timeouts"), 2);
  EXPECT_GE(count(sut, "retries"), 1);
  EXPECT_EQ(count(sut, "wrong_replies"), 0);
}

TEST(Pce174, SaysThatAnswersMakeNoSense) {
  for (const LuxFault fault : {LuxFault::kNonsense, LuxFault::kTruncated, LuxFault::kWrongChecksum}) {
    Pce174Meter meter;
    meter.settings.reply_timeout = 100ms;
    meter.emulator.set_fault(fault);
    Pce174 sut(meter.settings);
    const auto reading = sut.read(500ms);
    ASSERT_FALSE(reading.ok());
    EXPECT_EQ(reading.error().code, ErrorCode::kProtocol);
    EXPECT_THAT(reading.error().where, HasSubstr("answers make no sense"));
    EXPECT_GE(count(sut, "wrong_replies"), 1);
    meter.emulator.set_fault(LuxFault::kNone);
    EXPECT_TRUE(sut.read(20s).ok());
  }
}

TEST(Pce174, RefusesAHeldAnOverloadedAndCountsALowBattery) {
  Pce174Meter meter;
  Pce174 sut(meter.settings);
  meter.emulator.set_hold(true);
  auto reading = sut.read(20s);
  EXPECT_EQ(reading.error().code, ErrorCode::kNotReady);
  EXPECT_THAT(reading.error().where, HasSubstr("holds an old value: press HOLD"));
  meter.emulator.set_hold(false);
  meter.lux = 500e3;
  reading = sut.read(20s);
  EXPECT_EQ(reading.error().code, ErrorCode::kOutOfRange);
  meter.lux = 10;
  meter.emulator.set_low_battery(true);
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "low_battery_replies"), 1);
  EXPECT_EQ(count(sut, "overloads"), 1);
  EXPECT_EQ(count(sut, "not_ready"), 1);
}

TEST(Pce174, TakesASlowMeterWithinItsTime) {
  Pce174Meter meter;
  meter.emulator.set_answer_delay(300ms);
  Pce174 sut(meter.settings);
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "timeouts"), 0);
}

TEST(Pce174, ComesBackAfterItWasUnplugged) {
  Pce174Meter meter;
  meter.settings.reply_timeout = 100ms;
  Pce174 sut(meter.settings);
  ASSERT_TRUE(sut.read(20s).ok());
  meter.emulator.unplug();
  const auto reading = sut.read(120ms);
  ASSERT_FALSE(reading.ok());
  EXPECT_EQ(reading.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(reading.error().where, HasSubstr("plug it in again"));
  EXPECT_EQ(count(sut, "disconnects"), 1);
  meter.emulator.plug();
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "reconnects"), 1);
}

TEST(LuxMeterSettings, ChooseTheDriverByTheRigFile) {
  TemporaryFolder folder;
  const auto settings = [&](const std::string& text) {
    const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", text));
    auto s = lux_meter_settings_from(node, "/run/tankrig");
    node.finish();
    return s;
  };
  const auto pce174 =
      std::get<Pce174Settings>(settings("driver: pce174\ndevice: runtime/lux\nreply_timeout_ms: 250\n"));
  EXPECT_EQ(pce174.device, "/run/tankrig/lux");
  EXPECT_EQ(pce174.reply_timeout, 250ms);
  const auto t10a = std::get<T10aSettings>(
      settings("driver: t10a\ndevice: /dev/ttyUSB1\nhead: 3\ncolour_correction: true\nunit: foot_candle\n"));
  EXPECT_EQ(t10a.device, "/dev/ttyUSB1");
  EXPECT_EQ(t10a.head, 3);
  EXPECT_TRUE(t10a.colour_correction);
  EXPECT_EQ(t10a.unit, LuxUnit::kFootCandle);
  EXPECT_THAT(message_of<InputError>([&] { settings("driver: luxor\ndevice: x\n"); }),
              HasSubstr("rig.yaml:1: driver: found 'luxor', expected one of: pce174, t10a"));
  EXPECT_THAT(message_of<InputError>([&] { settings("driver: t10a\ndevice: x\nhead: 30\n"); }),
              HasSubstr("expected a number from 0 to 29"));
  EXPECT_THAT(message_of<InputError>([&] { settings("driver: pce174\ndevice: x\nhead: 3\n"); }), HasSubstr("head"));
}

TEST(LuxEmulatorSettings, FollowTheDeviceOfTheRigFile) {
  TemporaryFolder folder;
  const ConfigNode rig =
      ConfigNode::load(folder.write("rig.yaml",
                                    "lux_meter: {driver: t10a, device: runtime/lux, head: 4, unit: foot_candle}\n"
                                    "emulation: {answer_delay_ms: 7}\n"));
  const ConfigNode emulation = rig.child("emulation");
  const auto s = sim::lux_emulator_settings_from(rig.child("lux_meter"), &emulation, "/run/tankrig");
  rig.finish();
  EXPECT_EQ(s.kind, sim::LuxMeterKind::kT10a);
  EXPECT_EQ(s.name, "/run/tankrig/lux");
  EXPECT_EQ(s.head, 4);
  EXPECT_EQ(s.unit, LuxUnit::kFootCandle);
  EXPECT_EQ(s.answer_delay, 7ms);
}

TEST(LuxMeterSettings, SayWhatToDoWhenTheLineIsNotThere) {
  EXPECT_THAT(message_of<InputError>([] { open_lux_meter(Pce174Settings{.device = "/dev/ttyUSB97"}); }),
              HasSubstr("/dev/ttyUSB97 does not exist: plug the adapter in"));
}

}  // namespace
}  // namespace tankrig
