// A cycle that cannot read the laser says nothing of its light: neither to frames nor to the session.
#include <gtest/gtest.h>

#include "rig/capture/laser_timeline.hpp"
#include "rig/scan/scan_log.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using Light = LaserTimeline::Light;

Stamp at(Duration time) { return Stamp{1'000'000'000} + time; }

CycleRecord lit(Duration time) {
  CycleRecord record;
  record.stamp = at(time);
  record.laser.emplace();
  record.laser->emitting = true;
  record.laser->since = at(0ms);
  return record;
}

CycleRecord unread(Duration time) {
  CycleRecord record;
  record.stamp = at(time);
  return record;
}

TEST(LaserNotRead, LeavesTheTimelineWhereItWas) {
  LaserTimeline laser;
  laser.add(lit(10ms));
  laser.add(unread(20ms));
  EXPECT_EQ(laser.during(at(5ms), at(10ms)), Light::kOn);
  EXPECT_EQ(laser.during(at(5ms), at(15ms)), Light::kNotYetKnown);
  laser.add(lit(30ms));
  EXPECT_EQ(laser.during(at(5ms), at(30ms)), Light::kOn);
}

TEST(LaserNotRead, IsNoEventOfTheLaser) {
  const ScanPlan plan = make_scan_plan(testing_support::MockRig().s, testing_support::MockRig().s.park);
  testing_support::RecordingSink sink;
  ScanLog sut(plan, sink);
  sut.add(lit(10ms), "");
  sut.add(unread(20ms), "");
  ASSERT_EQ(sink.events.size(), 1u);
  EXPECT_EQ(sink.events[0].text, "emitting");
  CycleRecord dark = lit(40ms);
  dark.laser->emitting = false;
  dark.laser->since = at(35ms);
  sut.add(dark, "");
  ASSERT_EQ(sink.events.size(), 2u);
  EXPECT_EQ(sink.events[1].text, "dark");
  EXPECT_EQ(sink.events[1].when.ns, at(35ms).ns);
}

}  // namespace
}  // namespace tankrig
