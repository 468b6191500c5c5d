#include "drivers/arm/arm5e_settings.hpp"

#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "drivers/arm/arm5e.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

struct File {
  TemporaryFolder folder;
  Arm5eSettings read(const std::string& yaml, const std::string& carrier = {}) {
    const ConfigNode node = ConfigNode::load(folder.write("arm.yaml", yaml));
    const Arm5eSettings settings = arm5e_settings_from(node, folder.path() / "run", carrier);
    node.finish();
    return settings;
  }
  std::string message(const std::string& yaml) {
    return message_of<InputError>([&] { read(yaml); }).substr(folder.path().string().size() + 1);
  }
};

const std::string kCan = "carrier: can\ncan: {interface: can0, bitrate_bit_s: 500000}\n";
const std::string kSerial = "carrier: serial\nserial: {device: /dev/ttyUSB0}\n";

TEST(Arm5eSettings, HaveDefaultsForEverythingButTheWire) {
  File file;
  const Arm5eSettings can = file.read(kCan), serial = file.read(kSerial);
  EXPECT_EQ(can.carrier, ArmCarrier::kCan);
  EXPECT_EQ(can.exchange_rate_hz, 100);
  EXPECT_EQ(can.can.filters.size(), 16U);
  EXPECT_EQ(serial.carrier, ArmCarrier::kSerial);
  EXPECT_EQ(serial.exchange_rate_hz, 50);
  EXPECT_EQ(serial.serial.baud, 115200);
  EXPECT_EQ(serial.pid, (PidSlot{{0, 0, 0}, {255, 4, 0}}));
  EXPECT_TRUE(serial.zero_file.empty());
}

TEST(Arm5eSettings, ReadEveryKey) {
  File file;
  const Arm5eSettings s = file.read(R"(
carrier: can
can:
  interface: "unix:runtime/bus"
  bitrate_bit_s: 1000000
  exchange_rate_hz: 200
  ids: {demand: [1, 2, 3, 4, 5], pid: [0x6, 0x7, 0x8, 0x9, 0xA], sensors: [17, 18, 19, 20, 21], master: 0x7FF}
serial: {device: runtime/arm, baud: 230400, exchange_rate_hz: 80}
encoder_latency_ms: 1.5
reply_timeout_ms: 30
silence_timeout_ms: 300
watchdog_ms: 400
zero_file: runtime/zero.yaml
creep_rad_s: 0.02
max_ticks_per_s: 1500
dead_zone_rad_s: [0.1, 0.2, 0.3, 0.4, 0.5]
speed_limit_raw: 2000
current_limit_raw: 1000
jaw_current_limit_raw: 100
over_current_a: 3
over_current_s: 2
water_ingress_raw: 9
posture_margin_rad: 0.1
pid: {position: [1, 2, 3], speed: [4, 5, 6]}
encoder: {jump_ticks: 500, persists_samples: 4}
joint_current: le16
scaling: micro
homing:
  speed_ticks_per_s: 1000
  stop_current_a: 0.6
  pause_s: 1
  longest_s: 20
  direction: {slew: positive, elbow: none}
  rest_angle_rad: {elbow: 1.5}
)");
  EXPECT_EQ(s.can.interface, "unix:" + (file.folder.path() / "run" / "bus").string());
  EXPECT_EQ(s.exchange_rate_hz, 200);
  EXPECT_EQ(s.can_ids.demand[4], 5);
  EXPECT_EQ(s.can_ids.pid_answer[0], 0x191);
  EXPECT_EQ(s.can_ids.master, 0x7FF);
  EXPECT_EQ(s.serial.device, (file.folder.path() / "run" / "arm").string());
  EXPECT_EQ(s.encoder_latency, std::chrono::microseconds(1500));
  EXPECT_EQ(s.watchdog, std::chrono::milliseconds(400));
  EXPECT_EQ(s.zero_file, file.folder.path() / "run" / "zero.yaml");
  EXPECT_EQ(s.shaping.dead_zone[2], 0.3);
  EXPECT_EQ(s.shaping.max_ticks_per_s, 1500);
  EXPECT_EQ(s.current_limit, 1000);
  EXPECT_EQ(s.over_current.duration, std::chrono::seconds(2));
  EXPECT_EQ(s.water_ingress_raw, 9);
  EXPECT_EQ(s.pid, (PidSlot{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(s.encoder.jump_ticks, 500);
  EXPECT_EQ(s.tail, TailMeaning::kLe16);
  EXPECT_EQ(s.scaling.volt_per_count, 0.21);
  EXPECT_EQ(s.homing.direction[kSlew], HomeDirection::kPositive);
  EXPECT_EQ(s.homing.direction[kShoulder], HomeDirection::kNegative);
  EXPECT_EQ(s.homing.direction[kElbow], HomeDirection::kNone);
  EXPECT_EQ(s.homing.rest_angle[kElbow], 1.5);
}

TEST(Arm5eSettings, TakeTheOtherCarrierWhenAsked) {
  File file;
  const std::string both = kCan + "serial: {device: /dev/ttyUSB0, exchange_rate_hz: 60}\n";
  EXPECT_EQ(file.read(both).exchange_rate_hz, 100);
  const Arm5eSettings serial = file.read(both, "serial");
  EXPECT_EQ(serial.carrier, ArmCarrier::kSerial);
  EXPECT_EQ(serial.exchange_rate_hz, 60);
  EXPECT_NE(file.message("carrier: serial\ncan: {interface: can0}\n").find("expected one for the carrier serial"),
            std::string::npos);
}

TEST(Arm5eSettings, TakeAFastJointOnCan) {
  File file;
  const auto can = [](const std::string& more) {
    return "carrier: can\ncan: {interface: can0, bitrate_bit_s: 1000000, " + more + "}\n";
  };
  EXPECT_EQ(file.read(kCan).fast_joint, std::nullopt);
  const Arm5eSettings fast = file.read(can("exchange_rate_hz: 1000, fast_joint: elbow"));
  EXPECT_EQ(fast.fast_joint, kElbow);
  EXPECT_NEAR(carrier_load(fast).load, 0.405, 1e-12);
  EXPECT_NE(file.message(can("exchange_rate_hz: 1000")).find("11 frames"), std::string::npos);
  EXPECT_NE(file.message(can("fast_joint: wrist")).find("wrist"), std::string::npos);
  EXPECT_NE(file.message(can("exchange_rate_hz: 50, fast_joint: elbow")).find("at most half of silence_timeout_ms"),
            std::string::npos);
}

// One exchange on CAN: ten frames of eight bytes at 135 bits and one of three at 85 bits at worst.
TEST(CarrierLoad, IsTheShareOfTheWire) {
  Arm5eSettings can;
  can.can.bitrate = 500'000;
  EXPECT_NEAR(carrier_load(can).load, 100 * 1435.0 / 500'000, 1e-12);
  EXPECT_NEAR(carrier_load(can).largest_rate_hz, 500'000 / 1435.0, 1e-9);
  Arm5eSettings serial;
  serial.carrier = ArmCarrier::kSerial;
  EXPECT_NEAR(carrier_load(serial).largest_rate_hz, 115200 / 1020.0, 1e-4);  // 112.9: two frames of 510 bits
  EXPECT_NEAR(carrier_load(serial).load, 100 * 1020.0 / 115200, 1e-6);
}

TEST(CarrierLoad, AboveSeventyPercentIsRefusedWithTheRateThatIsAllowed) {
  File file;
  EXPECT_EQ(file.message("carrier: serial\nserial:\n  device: /dev/ttyUSB0\n  exchange_rate_hz: 100\n"),
            "arm.yaml:4: serial.exchange_rate_hz: found 100 exchanges/s, a load of 88.5 % (51 bytes each way at 115200 "
            "baud), expected at most 79/s (70 %)");
  EXPECT_EQ(
      file.message("carrier: can\ncan: {interface: can0, bitrate_bit_s: 125000}\n"),
      "arm.yaml:2: can.interface: found 100 exchanges/s, a load of 114.8 % (11 frames of together 1435 bits at most, "
      "at 125000 bit/s), expected at most 60.9/s (70 %)");
  Arm5eSettings settings;
  settings.exchange_rate_hz = 244;
  EXPECT_THROW(check_carrier_load(settings), InputError);
  settings.exchange_rate_hz = 243;
  EXPECT_NO_THROW(check_carrier_load(settings));
  settings.exchange_rate_hz = 900;
  EXPECT_THROW(open_arm5e(settings, arm5e(), MonotonicClock()), InputError);
}

TEST(Arm5eSettings, RefuseWhatCannotBe) {
  File file;
  EXPECT_NE(file.message(kCan + "water: 3\n").find("unknown key"), std::string::npos);
  EXPECT_NE(file.message("carrier: usb\n").find("carrier"), std::string::npos);
  EXPECT_NE(file.message(kCan + "pid: {speed: [1, 2, 256]}\n")
                .find("pid.speed: found [1, 2, 256], expected three whole numbers from 0 to 255"),
            std::string::npos);
  EXPECT_NE(file.message("carrier: can\ncan: {interface: can0, ids: {master: 0x201}}\n")
                .find("found 0x201 twice, expected every identifier once"),
            std::string::npos);
  EXPECT_NE(file.message("carrier: can\ncan: {interface: can0, ids: {demand: [1, 2, 3, 4, 2048]}}\n")
                .find("found 2048, expected an identifier of 11 bits: 0 .. 0x7FF"),
            std::string::npos);
}

TEST(OpenArm5e, SaysWhatIsMissing) {
  MonotonicClock clock;
  Arm5eSettings settings;
  settings.carrier = ArmCarrier::kSerial;
  settings.exchange_rate_hz = 50;
  settings.serial.device = "/nonexistent/ttyUSB9";
  const std::string message = message_of<InputError>([&] { open_arm5e(settings, arm5e(), clock); });
  EXPECT_NE(message.find("/nonexistent/ttyUSB9"), std::string::npos) << message;
}

TEST(ArmZero, ComesBackFromItsFile) {
  TemporaryFolder folder;
  const auto file = folder.path() / "zero.yaml";
  save_arm_zero(file, {{1, 65535, 3, 0, 40000}, "2026-01-31T12:00:00Z"});
  save_arm_zero(file, {{1, 65535, 3, 0, 40001}, "2026-01-31T12:00:01Z"});
  const ArmZero zero = load_arm_zero(file);
  EXPECT_EQ(zero.raw, (std::array<std::uint16_t, kJoints>{1, 65535, 3, 0, 40001}));
  EXPECT_EQ(zero.taken, "2026-01-31T12:00:01Z");
  EXPECT_FALSE(zero.exit);
  for (const ArmZero& whole :
       {ArmZero{zero.raw, zero.taken, ArmZero::OrderlyExit{{9, 8, 7, 65535, 5}, "2026-01-31T13:00:00Z"}, ""},
        ArmZero{zero.raw, zero.taken, {}, "an encoder lost its reference"}}) {
    save_arm_zero(file, whole);
    EXPECT_EQ(load_arm_zero(file), whole);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "something is left behind";
}

TEST(ArmZero, RefusesAFileThatIsNone) {
  TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    return message_of<InputError>([&] { load_arm_zero(folder.write("zero.yaml", text)); });
  };
  EXPECT_NE(message("taken: now\n").find("raw_ticks_at_zero"), std::string::npos);
  EXPECT_NE(message("taken: now\nraw_ticks_at_zero: {slew: 70000, shoulder: 0, elbow: 0, jaw_rotate: 0, "
                    "jaw_opening: 0}\n")
                .find("zero.yaml:2: raw_ticks_at_zero.slew: found '70000'"),
            std::string::npos);
  EXPECT_NE(message_of<InputError>([&] {
              save_arm_zero(folder.path() / "none" / "zero.yaml", {});
            }).find("cannot be written"),
            std::string::npos);
}

}  // namespace
}  // namespace tankrig
