#include "sim_backends/wire/arm_electronics.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

struct ElectronicsBench {
  VirtualClock clock{Stamp{1'000'000'000}};
  ArmEmulatorParameters parameters;
  ArmModel model = arm5e();
  std::unique_ptr<ArmElectronics> make(bool gains = true) {
    auto electronics = std::make_unique<ArmElectronics>(model, parameters, clock);
    if (gains) {
      ArmRequest pid{HostSlot::kPid, {}};
      pid.slots.fill(encode(PidSlot{{}, {255, 4, 0}}));
      electronics->request(pid, clock.now());
    }
    return electronics;
  }
};

ArmRequest drive(DemandType type, std::uint16_t speed, std::uint16_t limit = kLargestSpeed) {
  ArmRequest request;
  request.slots[kElbow] = {static_cast<std::uint8_t>(type),
                           static_cast<std::uint8_t>(speed >> 8),
                           static_cast<std::uint8_t>(speed),
                           static_cast<std::uint8_t>(limit >> 8),
                           static_cast<std::uint8_t>(limit),
                           0x0F,
                           0xFF,
                           0};
  return request;
}

SensorSlot elbow_of(const std::optional<ArmReply>& reply) { return decode_sensors(reply.value().slots[kElbow]); }

/// The elbow's speed [ticks/s] half a second after the request.
double speed_after(ElectronicsBench& bench, ArmElectronics& sut, const ArmRequest& request) {
  sut.request(request, bench.clock.now());
  bench.clock.sleep_until(bench.clock.now() + 400ms);
  return static_cast<std::int16_t>(elbow_of(sut.request(request, bench.clock.now())).speed);
}

TEST(ArmElectronics, AnswerGainsWithTheirEchoAndDemandsWithSensors) {
  ElectronicsBench bench;
  const auto made = bench.make(false);
  ArmElectronics& sut = *made;
  ArmRequest pid{HostSlot::kPid, {}};
  pid.slots.fill(encode(PidSlot{{1, 2, 3}, {4, 5, 6}}));
  const auto echo = sut.request(pid, bench.clock.now());
  ASSERT_TRUE(echo);
  EXPECT_EQ(echo->kind, ArmSlot::kPid);
  EXPECT_EQ(echo->slots, pid.slots);
  const auto sensors = sut.request(drive(DemandType::kStop, 0), bench.clock.now());
  ASSERT_TRUE(sensors);
  EXPECT_EQ(sensors->kind, ArmSlot::kSensors);
  EXPECT_EQ(elbow_of(sensors).position, 0) << "relative encoders read 0 at power-up";
  EXPECT_NEAR(laboratory_scaling().volts(sensors->master.voltage), 24, 0.2);
}

TEST(ArmElectronics, ObeySpeedDemandsBothWaysWithinTheirLimit) {
  ElectronicsBench bench;
  const auto made = bench.make();
  ArmElectronics& sut = *made;
  EXPECT_NEAR(speed_after(bench, sut, drive(DemandType::kSpeedForward, 300)), 300, 1);
  EXPECT_NEAR(speed_after(bench, sut, drive(DemandType::kSpeedBackward, 300)), -300, 1);
  EXPECT_NEAR(speed_after(bench, sut, drive(DemandType::kSpeedForward, 300, 200)), 200, 1);
  EXPECT_EQ(speed_after(bench, sut, drive(DemandType::kStop, 300)), 0);
}

TEST(ArmElectronics, DoNothingWithoutGainsOrInPositionMode) {
  ElectronicsBench bench;
  const auto without = bench.make(false), with = bench.make();
  EXPECT_EQ(speed_after(bench, *without, drive(DemandType::kSpeedForward, 300)), 0);
  EXPECT_EQ(speed_after(bench, *with, drive(DemandType::kPosition, 300)), 0);
  EXPECT_EQ(speed_after(bench, *with, drive(static_cast<DemandType>(9), 300)), 0);
}

TEST(ArmElectronics, GoMuteOnALowByteOfTenUntilTheFrameChanges) {
  ElectronicsBench bench;
  const auto made = bench.make();
  ArmElectronics& sut = *made;
  const ArmRequest ten = drive(DemandType::kSpeedForward, 0x010A);
  EXPECT_FALSE(sut.request(ten, bench.clock.now()));
  EXPECT_FALSE(sut.request(ten, bench.clock.now()));
  EXPECT_TRUE(sut.request(drive(DemandType::kSpeedForward, 0x010B), bench.clock.now()));
}

TEST(ArmElectronics, RestWhenNoRequestComes) {
  ElectronicsBench bench;
  bench.parameters.watchdog = 300ms;
  const auto made = bench.make();
  ArmElectronics& sut = *made;
  sut.request(drive(DemandType::kSpeedForward, 300), bench.clock.now());
  bench.clock.sleep_until(bench.clock.now() + 290ms);
  EXPECT_NE(sut.true_velocity_at(bench.clock.now())[kElbow], 0);
  bench.clock.sleep_until(bench.clock.now() + 1s);
  EXPECT_EQ(sut.true_velocity_at(bench.clock.now())[kElbow], 0);
}

TEST(ArmElectronics, WrapTheirEncodersAndKnowTheTrueZero) {
  ElectronicsBench bench;
  bench.parameters.power_up_ticks[kElbow] = 65'530;
  const auto made = bench.make();
  ArmElectronics& sut = *made;
  const ArmRequest forward = drive(DemandType::kSpeedForward, 300);
  sut.request(forward, bench.clock.now());
  bench.clock.sleep_until(bench.clock.now() + 400ms);
  const Stamp now = bench.clock.now();
  const auto raw = elbow_of(sut.request(forward, now - bench.parameters.turnaround)).position;
  EXPECT_LT(raw, 200);
  const auto ticks = static_cast<std::int16_t>(static_cast<std::uint16_t>(raw - sut.true_zero()[kElbow]));
  EXPECT_NEAR(bench.model.actuators[kElbow].angle(ticks), sut.truth_at(now)[kElbow], 1e-3);
}

TEST(ArmElectronics, BeginAnewWhenTheSupplyComesBack) {
  ElectronicsBench bench;
  const auto made = bench.make();
  ArmElectronics& sut = *made;
  EXPECT_NEAR(speed_after(bench, sut, drive(DemandType::kSpeedForward, 300)), 300, 1);
  const JointVector before = sut.truth_at(bench.clock.now());
  sut.power_cycle({});
  const auto reply = sut.request(drive(DemandType::kStop, 0), bench.clock.now() - bench.parameters.turnaround);
  EXPECT_EQ(elbow_of(reply).position, 0);
  EXPECT_NEAR(sut.truth_at(bench.clock.now())[kElbow], before[kElbow], 1e-9);
  EXPECT_NEAR(speed_after(bench, sut, drive(DemandType::kSpeedForward, 300)), 0, 5) << "its gains are lost";
}

TEST(ArmElectronics, DoTheSameAgainForTheSameSeed) {
  const auto run = [] {
    ElectronicsBench bench;
    bench.parameters.mute_probability = bench.parameters.zero_peak_probability = 0.2;
    bench.parameters.power_up_ticks.fill(5000);
    const auto made = bench.make();
    ArmElectronics& sut = *made;
    std::vector<int> seen;
    for (int i = 0; i < 200; ++i) {
      const auto reply = sut.request(drive(DemandType::kSpeedForward, static_cast<std::uint16_t>(256 + i % 2)),
                                     bench.clock.now() + i * 1ms);
      seen.push_back(reply ? elbow_of(reply).position : -1);
    }
    return seen;
  };
  EXPECT_EQ(run(), run());
}

TEST(ArmEmulatorParameters, AreReadFromTheRigFile) {
  TemporaryFolder folder;
  const ConfigNode node = ConfigNode::load(folder.write("e.yaml", R"(
power_up_rad: [0, 0.1, 0.9, 0, 0]
power_up_ticks: [1, 2, 3, 4, 5]
backlash_ticks: [1, 1, 1, 1, 1]
stiction_ticks_per_s: [9, 9, 9, 9, 9]
time_constant_s: 0.02
watchdog_ms: 0
turnaround_ms: 1
encoder_latency_ms: 2
mute_probability: 0.1
zero_peak_probability: 0.2
mute_on_0a: false
seed: 12
)"));
  const ArmEmulatorParameters p = settings_from(node, kArmEmulatorKeys);
  node.finish();
  EXPECT_EQ(p.power_up[kElbow], 0.9);
  EXPECT_EQ(p.power_up_ticks[4], 5);
  EXPECT_EQ(p.plant.stiction_ticks_per_s[0], 9);
  EXPECT_EQ(p.watchdog, 0ms);
  EXPECT_EQ(p.encoder_latency, 2ms);
  EXPECT_FALSE(p.mute_on_0a);
  EXPECT_EQ(p.seed, 12U);
  const ConfigNode wrong = ConfigNode::load(folder.write("w.yaml", "mute_probability: 2\n"));
  EXPECT_THROW(settings_from(wrong, kArmEmulatorKeys), InputError);
}

}  // namespace
}  // namespace tankrig::sim
