// The fault plan: one strict file, one table of what each device offers, the same faults from the same seed.
#include "sim_backends/faults/fault_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "sim_backends/faults/fault_script.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

FaultPlan plan_of(const std::string& text) {
  const TemporaryFolder folder;
  return FaultPlan::load(folder.write("faults.yaml", text));
}

std::string refusal(const std::string& text) {
  return message_of<InputError>([&] { plan_of(text); });
}

TEST(FaultPlan, ReadsWhatWhenAndHowLong) {
  const FaultPlan plan = plan_of(
      "faults:\n"
      "  - {device: camera mono, kind: dropped, from: laser_on, at_s: 1.5, duration_s: 2, ratio: 0.1, seed: 7}\n"
      "  - {device: arm, kind: bus_off, phase: sweep}\n");
  ASSERT_EQ(plan.faults.size(), 2u);
  EXPECT_EQ(plan.faults[0].name(), "camera mono: dropped");
  EXPECT_EQ(plan.faults[0].origin, FaultOrigin::kLaserOn);
  EXPECT_EQ(plan.faults[0].at, 1500ms);
  EXPECT_EQ(plan.faults[0].duration, 2s);
  EXPECT_EQ(plan.faults[0].ratio, 0.1);
  EXPECT_EQ(plan.faults[0].seed, 7u);
  EXPECT_EQ(plan.faults[1].origin, FaultOrigin::kPhase);
}

TEST(FaultPlan, IsTheSameAfterItsOwnYaml) {
  const FaultPlan plan = plan_of(
      "faults:\n  - {device: camera left, kind: clock_jump, from: motion, at_s: 0.25, jump_s: -0.5}\n"
      "  - {device: laser, kind: delayed, phase: sweep pass 1, delay_s: 0.3, seed: 9}\n");
  EXPECT_EQ(plan_of(plan.yaml()).yaml(), plan.yaml());
  EXPECT_EQ(plan_of(FaultPlan{}.yaml()).faults.size(), 0u);
}

TEST(FaultPlan, RefusesWhatADeviceDoesNotOfferAndListsWhatItDoes) {
  const std::string message = refusal("faults:\n  - {device: lux_meter, kind: bus_off}\n");
  EXPECT_THAT(message, HasSubstr("faults.yaml:2"));
  EXPECT_THAT(message, HasSubstr("it offers: off, stuck, garbage, wrong, slow, intermittent, unplugged, torn"));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0);
}

TEST(FaultPlan, RefusesUnknownDevicesKindsAndKeys) {
  EXPECT_THAT(refusal("faults:\n  - {device: sonar, kind: off}\n"), HasSubstr("expected one of: arm, camera"));
  EXPECT_THAT(refusal("faults:\n  - {device: arm, kind: broken}\n"), HasSubstr("kind"));
  EXPECT_THAT(refusal("faults:\n  - {device: arm, kind: off, duration: 3}\n"), HasSubstr("duration"));
  EXPECT_THAT(refusal("faults:\n  - {device: arm, kind: off, ratio: 1.5}\n"), HasSubstr("ratio"));
  EXPECT_THAT(refusal("faults:\n  - {device: arm, kind: off, from: phase}\n"), HasSubstr("phase: NAME"));
}

TEST(FaultPlan, TellsWhatIsNotToBeHadOnAWire) {
  const FaultPlan disk = plan_of("faults:\n  - {device: disk, kind: disk_full}\n");
  disk.check(FaultLevel::kMock);
  EXPECT_EQ(message_of<InputError>([&] { disk.check(FaultLevel::kWire); }),
            "faults: disk: disk_full: not to be had on the emulated wire; disk offers there: nothing");
  const FaultPlan phase = plan_of("faults:\n  - {device: arm, kind: off, phase: sweep}\n");
  EXPECT_THAT(message_of<InputError>([&] { phase.check(FaultLevel::kWire); }), HasSubstr("knows no phases"));
}

TEST(FaultPlan, OffersEveryKindOfItsVocabularySomewhere) {
  for (int kind = 0; kind <= static_cast<int>(FaultKind::kWriteError); ++kind) {
    int offers = 0;
    for (const FaultOffer& offer : fault_offers()) {
      offers += static_cast<int>(offer.kind) == kind;
      EXPECT_TRUE(offer.mock || offer.wire) << to_string(offer.device) << " " << to_string(offer.kind);
    }
    EXPECT_GT(offers, 0) << to_string(static_cast<FaultKind>(kind));
  }
}

FaultScript script_of(const std::string& faults) { return FaultScript(plan_of("faults:\n  - " + faults + "\n")); }

TEST(FaultScript, BeginsAndEndsInItsTimeAndTellsItOnce) {
  FaultScript script = script_of("{device: arm, kind: off, at_s: 2, duration_s: 3}");
  EXPECT_FALSE(script.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 10s)) << "its origin has not come";
  script.mark(FaultOrigin::kStart, Stamp{} + 1s);
  script.mark(FaultOrigin::kStart, Stamp{} + 100s);
  EXPECT_FALSE(script.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 2999ms));
  EXPECT_TRUE(script.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 3s));
  EXPECT_TRUE(script.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 5999ms));
  EXPECT_FALSE(script.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 6s));
  EXPECT_TRUE(script.news(Stamp{} + 2s).empty());
  const auto news = script.news(Stamp{} + 7s);
  ASSERT_EQ(news.size(), 2u);
  EXPECT_EQ(news[0].text, "arm: off begins");
  EXPECT_EQ(news[0].when, Stamp{} + 3s);
  EXPECT_EQ(news[1].text, "arm: off ends");
  EXPECT_TRUE(script.news(Stamp{} + 8s).empty());
}

TEST(FaultScript, CountsFromMotionLightAndPhasesByTheBeginningOfTheirName) {
  FaultScript motion = script_of("{device: arm, kind: off, from: motion}");
  motion.mark(FaultOrigin::kLaserOn, Stamp{});
  EXPECT_FALSE(motion.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 1s));
  motion.mark(FaultOrigin::kMotion, Stamp{});
  EXPECT_TRUE(motion.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 1s));
  FaultScript phase = script_of("{device: arm, kind: off, phase: sweep}");
  phase.enter_phase("dark block before", Stamp{});
  EXPECT_FALSE(phase.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 1s));
  phase.enter_phase("sweep pass 0", Stamp{} + 2s);
  EXPECT_TRUE(phase.active(FaultDevice::kArm, FaultKind::kOff, Stamp{} + 2s));
}

TEST(FaultScript, ConcernsTheNamedCameraOrAllOfThem) {
  FaultScript one = script_of("{device: camera mono, kind: off}"), all = script_of("{device: camera, kind: off}");
  one.mark(FaultOrigin::kStart, Stamp{});
  all.mark(FaultOrigin::kStart, Stamp{});
  EXPECT_TRUE(one.active(FaultDevice::kCamera, FaultKind::kOff, Stamp{}, "mono"));
  EXPECT_FALSE(one.active(FaultDevice::kCamera, FaultKind::kOff, Stamp{}, "left"));
  EXPECT_TRUE(all.active(FaultDevice::kCamera, FaultKind::kOff, Stamp{}, "left"));
}

TEST(FaultScript, ComesAndGoesByItsSeedAlone) {
  const auto pattern = [](int seed) {
    FaultScript script =
        script_of("{device: laser, kind: intermittent, period_s: 0.1, ratio: 0.3, seed: " + std::to_string(seed) + "}");
    script.mark(FaultOrigin::kStart, Stamp{});
    std::string text;
    for (int i = 0; i < 1000; ++i) text += script.off_now(FaultDevice::kLaser, Stamp{} + i * 100ms + 50ms) ? 'x' : '.';
    return text;
  };
  EXPECT_EQ(pattern(1), pattern(1));
  EXPECT_NE(pattern(1), pattern(2));
  const std::string some = pattern(3);
  EXPECT_NEAR(static_cast<double>(std::count(some.begin(), some.end(), 'x')), 300, 60);
}

}  // namespace
}  // namespace tankrig::sim
