// An operator turns a lamp; the meter says when the level is there.
#include "rig/scan/lux_level.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace tankrig {
namespace {

using ::testing::ElementsAre;

/// Reads what it is given, one after another, and the last of them for ever; a negative number is no answer.
class ScriptedMeter final : public LuxMeter {
 public:
  explicit ScriptedMeter(std::vector<double> readings) : readings_(std::move(readings)) {}
  Result<LuxReading> read(Duration) override {
    const double lux = readings_[std::min(asked_++, readings_.size() - 1)];
    if (lux < 0) return Error{ErrorCode::kTimeout, 0, {}, "lux meter: no answer"};
    return LuxReading{{}, lux};
  }

 private:
  std::vector<double> readings_;
  std::size_t asked_ = 0;
};

TEST(LuxLevel, IsThereAfterThreeReadingsInARow) {
  ScriptedMeter meter({30, 150, 149, 170, -1, 148, 146, 145});
  VirtualClock clock;
  const std::atomic<bool> stop = false;
  std::vector<double> told;
  const auto found = wait_for_level(meter, clock, {147, 0.1}, stop, [&](const Result<LuxReading>& reading) {
    told.push_back(reading.ok() ? reading.value().lux : -1);
  });
  EXPECT_EQ(found, 145);
  EXPECT_THAT(told, ElementsAre(30, 150, 149, 170, -1, 148, 146, 145));
  EXPECT_NEAR(seconds(clock.now() - Stamp{}), 3.5, 1e-9);  // two readings a second
}

TEST(LuxLevel, ToleratesAShareOfTheLevelAndAtLeastOneLux) {
  EXPECT_TRUE((LuxLevel{207, 0.05}.holds(216)));
  EXPECT_FALSE((LuxLevel{207, 0.05}.holds(218)));
  EXPECT_TRUE((LuxLevel{0, 0.05}.holds(0.9)));
  EXPECT_FALSE((LuxLevel{0, 0.05}.holds(1.1)));
}

TEST(LuxLevel, IsGivenUpWhenAStopIsAskedFor) {
  ScriptedMeter meter({0});
  VirtualClock clock;
  std::atomic<bool> stop = false;
  int asked = 0;
  const auto found =
      wait_for_level(meter, clock, {12, 0.1}, stop, [&](const Result<LuxReading>&) { stop = ++asked == 5; });
  EXPECT_FALSE(found);
  EXPECT_EQ(asked, 5);
}

}  // namespace
}  // namespace tankrig
