// Both lux meters behind their drivers, on their emulators; then what the rig file says of them.
#include <gmock/gmock.h>

#include "core/input_error.hpp"
#include "drivers/lux/open_lux_meter.hpp"
#include "sim_backends/wire/lux_emulator.hpp"
#include "tests/serial/count.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using sim::LuxEmulator;
using sim::LuxFault;
using ::testing::HasSubstr;

struct Pce174Meter {
  using Driver = Pce174;
  static constexpr const char* kSwitchItOn = "no answer: switch it on";
  static constexpr double kNoise = 7;  ///< bytes of it before an answer, at least

  TemporaryFolder folder;
  std::atomic<double> lux{123.4};
  LuxEmulator emulator{{.kind = sim::LuxMeterKind::kPce174, .name = folder.path() / "lux", .answer_delay = 1ms},
                       [this] { return lux.load(); }};
  Pce174Settings settings{.device = (folder.path() / "lux").string(), .reply_timeout = 3s};
};

struct T10aMeter {
  using Driver = T10a;
  static constexpr const char* kSwitchItOn = "no answer: switch it on and check its cable, `driver` and `head`";
  static constexpr double kNoise = 14;

  TemporaryFolder folder;
  std::atomic<double> lux{123.4};
  LuxEmulator emulator{
      {.kind = sim::LuxMeterKind::kT10a, .name = folder.path() / "lux", .head = 3, .answer_delay = 1ms},
      [this] { return lux.load(); }};
  T10aSettings settings{.device = (folder.path() / "lux").string(), .head = 3, .reply_timeout = 3s, .settling = 1ms};
};

template <class Meter>
struct LuxMeters : testing::Test, Meter {};
using BothMeters = testing::Types<Pce174Meter, T10aMeter>;
struct MeterNames {
  template <class Meter>
  static std::string GetName(int) {
    return std::is_same_v<Meter, T10aMeter> ? "T10a" : "Pce174";
  }
};
TYPED_TEST_SUITE(LuxMeters, BothMeters, MeterNames);

TYPED_TEST(LuxMeters, ReadTheLightOverTheWire) {
  typename TypeParam::Driver sut(this->settings);
  const Stamp before = MonotonicClock{}.now();
  const auto reading = sut.read(20s);
  ASSERT_TRUE(reading.ok()) << reading.error().where;
  EXPECT_DOUBLE_EQ(reading.value().lux, 123.4);
  EXPECT_GE(reading.value().stamp, before);
  EXPECT_LE(reading.value().stamp, MonotonicClock{}.now());
  this->lux = 87000;
  EXPECT_DOUBLE_EQ(sut.read(20s).value().lux, 87000);
  EXPECT_EQ(count(sut, "retries"), 0);
  EXPECT_EQ(count(sut, "skipped_bytes"), 0);
}

TYPED_TEST(LuxMeters, FindTheAnswerBehindNoise) {
  this->emulator.set_fault(LuxFault::kGarbage);
  typename TypeParam::Driver sut(this->settings);
  const auto reading = sut.read(20s);
  ASSERT_TRUE(reading.ok()) << reading.error().where;
  EXPECT_DOUBLE_EQ(reading.value().lux, 123.4);
  EXPECT_GE(count(sut, "skipped_bytes"), TypeParam::kNoise);
}

TYPED_TEST(LuxMeters, AreOffWhenNothingAnswers) {
  this->settings.reply_timeout = 20ms;
  this->emulator.set_fault(LuxFault::kSilent);
  typename TypeParam::Driver sut(this->settings);
  const auto reading = sut.read(100ms);
  ASSERT_FALSE(reading.ok());
  EXPECT_EQ(reading.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(reading.error().where, HasSubstr(TypeParam::kSwitchItOn));
  EXPECT_GE(count(sut, "timeouts"), 2);
  EXPECT_GE(count(sut, "retries"), 1);
  EXPECT_EQ(count(sut, "wrong_replies"), 0);
}

TYPED_TEST(LuxMeters, SayThatAnswersMakeNoSense) {
  this->settings.reply_timeout = 100ms;
  typename TypeParam::Driver sut(this->settings);
  ASSERT_TRUE(sut.read(20s).ok());
  for (const LuxFault fault : {LuxFault::kNonsense, LuxFault::kTruncated, LuxFault::kWrongChecksum}) {
    const double wrong = count(sut, "wrong_replies");
    this->emulator.set_fault(fault);
    const auto reading = sut.read(500ms);
    ASSERT_FALSE(reading.ok());
    EXPECT_EQ(reading.error().code, ErrorCode::kProtocol);
    EXPECT_THAT(reading.error().where, HasSubstr("answers make no sense"));
    EXPECT_GE(count(sut, "wrong_replies"), wrong + 1);
    this->emulator.set_fault(LuxFault::kNone);
    EXPECT_TRUE(sut.read(20s).ok());
  }
}

TYPED_TEST(LuxMeters, RefuseAHeldAndAnOverloadedReadingAndCountALowBattery) {
  typename TypeParam::Driver sut(this->settings);
  this->emulator.set_hold(true);
  auto reading = sut.read(20s);
  EXPECT_EQ(reading.error().code, ErrorCode::kNotReady);
  EXPECT_THAT(reading.error().where, HasSubstr("holds an old value: "));
  this->emulator.set_hold(false);
  this->lux = 500e3;
  EXPECT_EQ(sut.read(20s).error().code, ErrorCode::kOutOfRange);
  this->lux = 10;
  this->emulator.set_low_battery(true);
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "low_battery_replies"), 1);
  EXPECT_EQ(count(sut, "overloads"), 1);
  EXPECT_EQ(count(sut, "not_ready"), 1);
}

TYPED_TEST(LuxMeters, MayBeSlowWithinTheirTime) {
  this->emulator.set_answer_delay(300ms);
  typename TypeParam::Driver sut(this->settings);
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "timeouts"), 0);
}

TYPED_TEST(LuxMeters, ComeBackAfterTheyWereUnplugged) {
  this->settings.reply_timeout = 100ms;
  typename TypeParam::Driver sut(this->settings);
  ASSERT_TRUE(sut.read(20s).ok());
  this->emulator.unplug();
  const auto reading = sut.read(120ms);
  ASSERT_FALSE(reading.ok());
  EXPECT_EQ(reading.error().code, ErrorCode::kDisconnected);
  EXPECT_THAT(reading.error().where, HasSubstr("plug it in again"));
  EXPECT_EQ(count(sut, "disconnects"), 1);
  this->emulator.plug();
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "reconnects"), 1);
}

TEST(T10a, IsToldAgainToListenAfterItWasUnplugged) {
  T10aMeter meter;
  meter.settings.reply_timeout = 100ms;
  T10a sut(meter.settings);
  ASSERT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "connections"), 1);
  meter.emulator.unplug();
  EXPECT_FALSE(sut.read(120ms).ok());
  meter.emulator.plug();
  EXPECT_TRUE(sut.read(20s).ok());
  EXPECT_EQ(count(sut, "connections"), 2);
}

TEST(T10a, ReadsAMeterThatShowsFootCandles) {
  T10aMeter meter;
  meter.settings.unit = LuxUnit::kFootCandle;
  meter.lux = 10;
  T10a sut(meter.settings);
  EXPECT_NEAR(sut.read(20s).value().lux, 107.639, 1e-3);
}

TEST(T10a, AnotherHeadsAnswerIsNotTaken) {
  T10aMeter meter;
  meter.settings.head = 4;
  meter.settings.reply_timeout = 50ms;
  T10a sut(meter.settings);
  EXPECT_EQ(sut.read(200ms).error().code, ErrorCode::kTimeout);
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
