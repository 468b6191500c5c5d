#include "rig/plan/scan_plan.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/input_error.hpp"
#include "tests/plan/bent_elbow_scan.hpp"

namespace tankrig {
namespace {

std::vector<std::string> names(const ScanPlan& plan) {
  std::vector<std::string> result;
  for (const Segment& s : plan.segments()) result.push_back(s.name);
  return result;
}

/// Elbow angles that frames at whole frame periods see within the recorded part of `pass`.
std::vector<double> elbow_grid(const ScanPlan& plan, const ScanSettings& s, int pass) {
  std::vector<double> grid;
  for (const Segment& segment : plan.segments()) {
    if (segment.phase != Phase::kSweep || segment.pass != pass) continue;
    for (int n = 0; n * s.capture.frame_period < segment.record_end; ++n)
      if (n * s.capture.frame_period > segment.record_begin)
        grid.push_back(plan.at(n * s.capture.frame_period).q[kElbow]);
  }
  return grid;
}

TEST(ScanPlan, GoesFromWhereTheArmIsThroughDarkBlocksAndSweepToPark) {
  const ScanSettings s = bent_elbow_scan();
  JointVector now = s.park;
  now[kSlew] = -0.2;
  const ScanPlan sut = make_scan_plan(s, now);
  const std::vector<std::string> expected{
      "move to the sweep's start", "settle",      "dark block before", "laser warm-up", "sweep pass 0", "settle",
      "dark block after",          "move to park"};
  EXPECT_EQ(names(sut), expected);
  EXPECT_TRUE(sut.at(-1).q.isApprox(now));
  EXPECT_TRUE(sut.at(sut.duration() + 1).q.isApprox(s.park));
  EXPECT_EQ(sut.at(sut.duration() + 1).velocity, JointVector::Zero());
}

TEST(ScanPlan, HasNoJumpInPositionAndKnowsItsDuration) {
  ScanSettings s = bent_elbow_scan();
  s.sweep.passes = 3;
  const ScanPlan sut = make_scan_plan(s, s.park);
  double sum = 0;
  for (const Segment& segment : sut.segments()) {
    EXPECT_NEAR(segment.begin, sum, 1e-12);
    sum += segment.duration;
  }
  EXPECT_DOUBLE_EQ(sut.duration(), sum);
  for (double t = 0; t < sut.duration(); t += 0.005)
    EXPECT_LE((sut.at(t + 0.005).q - sut.at(t).q).cwiseAbs().maxCoeff(), 0.1 * 0.005 + 1e-9) << t;
}

TEST(ScanPlan, SweepsAtConstantVelocityWhereItRecords) {
  const ScanSettings s = bent_elbow_scan();
  const ScanPlan sut = make_scan_plan(s, s.park);
  for (const Segment& segment : sut.segments()) {
    if (segment.phase != Phase::kSweep) continue;
    EXPECT_NEAR(sut.at(segment.record_begin).q[kElbow], s.sweep.from, 1e-12);
    EXPECT_NEAR(sut.at(segment.record_end).q[kElbow], s.sweep.to, 1e-12);
    for (double t = segment.record_begin; t <= segment.record_end; t += 0.01)
      EXPECT_NEAR(sut.at(t).velocity[kElbow], s.sweep.velocity, 1e-12);
  }
}

TEST(ScanPlan, AsksForTheLaserOnlyFromWarmUpToTheEndOfTheLastPass) {
  ScanSettings s = bent_elbow_scan();
  s.sweep.passes = 2;
  const ScanPlan sut = make_scan_plan(s, s.park);
  bool lit = false, was_lit = false;
  for (const Segment& segment : sut.segments()) {
    EXPECT_EQ(segment.laser, segment.sweeping);
    EXPECT_TRUE(segment.laser || segment.phase != Phase::kSweep);
    if (segment.phase == Phase::kDarkBefore || segment.phase == Phase::kDarkAfter) {
      EXPECT_FALSE(segment.laser);
      EXPECT_EQ(sut.at(segment.begin).q, sut.at(segment.end()).q);
    }
    EXPECT_FALSE(segment.laser && was_lit) << "lit twice";
    was_lit = was_lit || (lit && !segment.laser);
    lit = segment.laser;
  }
  EXPECT_TRUE(was_lit);
}

class Interleaving : public testing::TestWithParam<bool> {};

TEST_P(Interleaving, PutsTheLinesOfEveryPassBetweenThoseOfTheOthers) {
  ScanSettings s = bent_elbow_scan();
  s.sweep.passes = 4;
  s.sweep.there_and_back = GetParam();
  const ScanPlan sut = make_scan_plan(s, s.park);
  const double step = s.sweep.velocity * s.capture.frame_period;
  for (int pass = 0; pass < s.sweep.passes; ++pass) {
    const auto grid = elbow_grid(sut, s, pass);
    EXPECT_NEAR(static_cast<double>(grid.size()), (s.sweep.to - s.sweep.from) / step, 1.5);
    for (double elbow : grid) {
      const double lines = (elbow - s.sweep.from) / step - static_cast<double>(pass) / s.sweep.passes;
      EXPECT_NEAR(lines, std::round(lines), 1e-6) << "pass " << pass;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(BothWays, Interleaving, testing::Bool());

TEST(ScanPlan, CountsTheFramesToCome) {
  const ScanSettings s = bent_elbow_scan();
  const ScanPlan sut = make_scan_plan(s, s.park);
  EXPECT_EQ(sut.expected_frames(RecordWhen::kDark, 0.04, s.capture.dark_frames), 20);
  EXPECT_NEAR(sut.expected_frames(RecordWhen::kSweep, 0.04, s.capture.dark_frames), 200, 1);
  EXPECT_NEAR(sut.expected_frames(RecordWhen::kAll, 0.04, s.capture.dark_frames), 220, 1);
}

void expect_refused(const ScanSettings& s, const std::string& word) {
  try {
    make_scan_plan(s, s.park);
    FAIL() << "accepted, expected a word about " << word;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

TEST(ScanPlan, RefusesSettingsThatMakeNoScan) {
  ScanSettings s = bent_elbow_scan();
  s.sweep.velocity = 0;
  expect_refused(s, "sweep_velocity");
  s = bent_elbow_scan();
  s.sweep.to = s.sweep.from;
  expect_refused(s, "sweep_to");
  s = bent_elbow_scan();
  s.sweep.passes = 0;
  expect_refused(s, "passes");
  s = bent_elbow_scan();
  s.capture.frame_period = std::nan("");
  expect_refused(s, "frame_period");
}

TEST(ScanPlan, PairsFramesOnlyWithALaserThatSwitchesFasterThanAFrame) {
  ScanSettings s = bent_elbow_scan();
  s.capture.laser_pairs = true;
  s.capture.laser_warm_up = 0;
  expect_refused(s, "laser_pairs");
  s.capture.laser_switches_per_frame = true;
  EXPECT_NO_THROW(make_scan_plan(s, s.park));
  s.capture.laser_warm_up = 1;
  expect_refused(s, "laser_warm_up");
}

}  // namespace
}  // namespace tankrig
