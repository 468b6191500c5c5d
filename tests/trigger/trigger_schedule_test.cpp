// Every exposure of the plan is asked for or counted as skipped, however late the cycle is.
#include "rig/capture/trigger_schedule.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/mock_rig.hpp"
#include "tests/trigger/planned_exposures.hpp"

namespace tankrig {
namespace {

constexpr double kFramePeriod = 0.04, kFrameSpacing = 4e-3;

struct Asked {
  std::uint64_t requests = 0, skipped = 0;
};

/// A run of the plan by an arm that follows it; of ten cycles one comes late, by up to `latest` [s].
Asked run(const ScanPlan& plan, const ScanSettings& settings, TriggerMode mode, unsigned seed, double latest) {
  std::mt19937 random(seed);
  TriggerSchedule sut(plan, settings, {mode, kFrameSpacing, std::nullopt}, RecordWhen::kAll, kFramePeriod);
  sut.set_delay(std::chrono::milliseconds{seed % 8});
  Asked asked;
  for (double t = 0; t < plan.duration(); t += 1 / settings.cycle_hz) {
    if (latest > 0 && random() % 10 == 0) t += std::uniform_real_distribution<double>(0, latest)(random);
    CycleRecord record;
    record.state = ExecutiveState::kRunning;
    record.plan_time = t;
    record.stamp = Stamp{} + from_seconds(t);
    record.has_joints = true;
    record.joints.stamp = record.stamp;
    record.joints.q = plan.at(t).q;
    record.joints.velocity = plan.at(t).velocity;
    asked.requests += sut.next(record).has_value();
  }
  asked.skipped = sut.skipped();
  return asked;
}

TEST(TriggerSchedule, AsksForOrCountsEveryExposureOfThePlanHoweverLateTheCycleIs) {
  const testing_support::MockRig rig;
  const ScanPlan plan = make_scan_plan(rig.s, rig.s.park);
  for (const bool at_angles : {false, true})
    for (unsigned seed = 0; seed < 100; ++seed) {
      const double latest = seed == 0 ? 0 : 0.4;
      const Asked asked = run(plan, rig.s, at_angles ? TriggerMode::kPosition : TriggerMode::kSoftware, seed, latest);
      const std::uint64_t angles = at_angles ? testing_support::planned_angles(rig.s, kFrameSpacing) : 0;
      EXPECT_EQ(asked.requests + asked.skipped, angles + testing_support::planned_times(plan, kFramePeriod, !at_angles))
          << "seed " << seed << (at_angles ? " at angles" : " at times");
      EXPECT_EQ(asked.skipped > 0, latest > 0) << "seed " << seed;
    }
}

}  // namespace
}  // namespace tankrig
