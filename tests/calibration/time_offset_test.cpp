#include "calibration/time_offset/time_offset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "core/input_error.hpp"
#include "tests/calibration/generated_sweep.hpp"
#include "tests/support/seeds.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;
using testing_support::GeneratedSweep;

TEST(TimeOffset, IsExactOnAPerfectSweep) {
  for (const double offset : {-0.060, -0.005, 0.0, 0.020, 0.060}) {
    GeneratedSweep sweep;
    sweep.offset = offset;
    sweep.ticks = false;
    sweep.noise_px = 1e-6;
    const TimeOffsetSolution s = solve(sweep.problem());
    EXPECT_NEAR(s.offset, offset, 2e-5);
    EXPECT_LT(s.after.median, 1e-5);
    EXPECT_GT(s.pairs, 1000u);
  }
}

TEST(TimeOffset, IsPositiveWhereTheCamerasStampsAreLate) {
  GeneratedSweep sweep;
  sweep.offset = 0.030;  // t_camera = t_joints + offset, as the header says
  EXPECT_GT(solve(sweep.problem()).offset, 0.029);
}

TEST(TimeOffset, BringsTheTwoCloudsTogether) {
  GeneratedSweep sweep;
  sweep.offset = 0.040;
  const TimeOffsetSolution s = solve(sweep.problem());
  // One way the stripe is late, the other way it is early: the clouds lie twice the effect apart.
  EXPECT_NEAR(s.before.median, 2 * s.effect, 0.3 * s.effect);
  EXPECT_LT(s.after.median, 0.1 * s.before.median);
  EXPECT_NEAR(s.effect, s.speed_on_target * s.offset, 1e-9);
  EXPECT_GT(s.speed_on_target, 0.05);  // 0.1 rad/s at about a metre
  EXPECT_LT(s.speed_on_target, 0.8);
}

TEST(TimeOffset, HasASigmaThatIsWhatTheSolutionsScatterBy) {
  constexpr int kSeeds = 40;
  double sum = 0, squares = 0, sigmas = 0, worst = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    GeneratedSweep sweep;
    sweep.offset = 0.017;
    sweep.noise_px = 0.3;
    sweep.seed = static_cast<unsigned>(seed);
    const TimeOffsetSolution s = solve(sweep.problem());
    const double error = s.offset - sweep.offset;
    sum += error;
    squares += error * error;
    sigmas += s.sigma;
    worst = std::max(worst, std::abs(error));
  }
  const double mean = sum / kSeeds, scatter = std::sqrt((squares - kSeeds * mean * mean) / (kSeeds - 1));
  std::printf("seeds 1..%d: bias %.4f ms, scatter %.4f ms, mean sigma %.4f ms, worst error %.4f ms\n", kSeeds,
              1e3 * mean, 1e3 * scatter, 1e3 * sigmas / kSeeds, 1e3 * worst);
  EXPECT_LT(std::abs(mean), 3 * scatter / std::sqrt(kSeeds) + 2e-5);
  EXPECT_LT(sigmas / kSeeds, 2 * scatter);
  EXPECT_GT(sigmas / kSeeds, 0.5 * scatter);
  EXPECT_LT(worst, 4 * scatter);  // a sigma of two waves is itself uncertain: what one is worth, Interval shows
}

TEST(JointMotion, IsThatOfTheLinkThoughReadingsComeInTicks) {
  for (const double velocity : {0.065, 0.1, 0.2}) {
    GeneratedSweep sweep;
    sweep.velocity = velocity;
    const TimeOffsetProblem problem = sweep.problem();
    const auto& [joints, stripes] = problem.recordings[0];
    for (const TimedStripe& stripe : stripes) {
      const double expected = stripe.pass == 0 ? velocity : -velocity;
      EXPECT_NEAR(motion_at(joints, stripe.stamp).velocity[kElbow], expected, 0.03 * velocity);
    }
    // At rest before the sweep; and where readings are few.
    EXPECT_NEAR(motion_at(joints, joints[20].stamp).velocity.norm(), 0, 1e-12);
    const std::vector<TimedJoints> two{{Stamp{}, JointVector::Zero()},
                                       {Stamp{} + from_seconds(2), JointVector::Ones()}};
    EXPECT_NEAR(motion_at(two, Stamp{} + from_seconds(0.5)).q[0], 0.25, 1e-12);
    EXPECT_NEAR(motion_at(two, Stamp{} + from_seconds(0.5)).velocity[0], 0.5, 1e-12);
  }
}

struct Conditions {
  const char* name;
  double noise_px, velocity, to;
  int line_step;
};

class Interval : public testing::TestWithParam<Conditions> {};

/// Frames and joint samples fall anywhere on the sweep and on the encoders' ticks, other ones with every seed.
TEST_P(Interval, HoldsTheTruthAsOftenAsItSays) {
  const int seeds = testing_support::seeds(100);
  int held = 0;
  double squares = 0, variances = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    GeneratedSweep sweep;
    sweep.offset = 0.017;
    sweep.noise_px = GetParam().noise_px;
    sweep.velocity = GetParam().velocity;
    sweep.to = GetParam().to;
    sweep.line_step = GetParam().line_step;
    sweep.seed = static_cast<unsigned>(seed);
    const TimeOffsetSolution s = solve(sweep.problem());
    const double error = s.offset - sweep.offset;
    held += std::abs(error) <= s.half_width;
    squares += error * error / seeds;
    variances += s.sigma * s.sigma / seeds;
  }
  std::printf("%s: seeds 1..%d: error %.4f ms, sigma %.4f ms (both rms); ", GetParam().name, seeds,
              1e3 * std::sqrt(squares), 1e3 * std::sqrt(variances));
  testing_support::expect_honest(held, seeds);
}

INSTANTIATE_TEST_SUITE_P(TimeOffset, Interval,
                         testing::Values(Conditions{"Ordinary", 0.3, 0.1, 1.85, 24},
                                         Conditions{"LittleNoise", 0.1, 0.1, 1.85, 24},
                                         Conditions{"ShortSweep", 0.3, 0.1, 1.70, 24},
                                         Conditions{"SlowSweep", 0.3, 0.065, 1.85, 24},
                                         Conditions{"FastSweep", 0.3, 0.2, 1.85, 24}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(TimeOffset, ReadsPlayAsAnOffsetAtOneSpeedAndSaysHowMuch) {
  GeneratedSweep sweep;
  sweep.backlash = 0.5e-3;
  const TimeOffsetSolution s = solve(sweep.problem());
  EXPECT_FALSE(s.backlash);
  EXPECT_NEAR(s.offset_per_backlash, 1 / (2 * sweep.velocity), 0.3);
  EXPECT_NEAR(s.offset, s.offset_per_backlash * sweep.backlash, 2e-4);
}

TEST(TimeOffset, TellsPlayFromTimeByTwoSpeeds) {
  GeneratedSweep slow, fast;
  slow.backlash = fast.backlash = 0.5e-3;
  slow.offset = fast.offset = 0.020;
  slow.velocity = 0.08;
  fast.velocity = 0.16;
  fast.seed = 2;
  TimeOffsetProblem problem = slow.problem();
  problem.recordings.push_back(fast.recording(problem));
  const TimeOffsetSolution s = solve(problem);
  ASSERT_TRUE(s.backlash);
  EXPECT_NEAR(*s.backlash, 0.5e-3, 4 * s.backlash_sigma + 1e-5);
  EXPECT_NEAR(s.offset, 0.020, 4 * s.sigma + 2e-5);
  EXPECT_LT(s.sigma, 0.5e-3);
  EXPECT_THAT(s.speeds, testing::ElementsAre(testing::DoubleNear(0.08, 2e-3), testing::DoubleNear(0.16, 4e-3)));
}

TEST(TimeOffset, HardlyMindsAWrongLaserPlane) {
  GeneratedSweep sweep;
  sweep.offset = 0.010;
  TimeOffsetProblem problem = sweep.problem();
  problem.ePl.normal = Eigen::AngleAxisd(0.01, Vector3d::UnitY()) * problem.ePl.normal;  // ten times a bad calibration
  EXPECT_NEAR(solve(problem).offset, 0.010, 2e-4);
}

TEST(TimeOffset, IsNotLedAstrayByReflections) {
  GeneratedSweep sweep;
  sweep.offset = 0.025;
  TimeOffsetProblem problem = sweep.problem();
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> anywhere(0, 575), share(0, 1);
  for (TimedStripe& s : problem.recordings[0].stripes)
    for (TimedStripePoint& p : s.points)
      if (share(random) < 0.05) p.position = anywhere(random);
  EXPECT_NEAR(solve(problem).offset, 0.025, 3e-4);
}

TEST(TimeOffset, WorksOnStripesAcrossTheRows) {
  GeneratedSweep sweep;
  sweep.offset = 0.020;
  TimeOffsetProblem problem = sweep.problem();
  // The same scene with the camera's image transposed.
  const CameraModel c = problem.camera;
  problem.camera = {c.height, c.width, c.fy, c.fx, c.cy, c.cx};
  Transform transpose = Transform::Identity();
  transpose.linear() << 0, 1, 0, 1, 0, 0, 0, 0, 1;  // mirrors: fine for planes and rays
  problem.cMb = transpose * problem.cMb;
  problem.rows = true;
  EXPECT_NEAR(solve(problem).offset, 0.020, 3e-4);
}

void expect_refusal(const TimeOffsetProblem& problem, const char* words) {
  try {
    solve(problem);
    ADD_FAILURE() << "accepted, expected a refusal with: " << words;
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr(words));
  }
}

TEST(TimeOffset, RefusesASweepInOneDirectionAndSaysWhatToRecord) {
  TimeOffsetProblem problem = GeneratedSweep{}.problem();
  std::erase_if(problem.recordings[0].stripes, [](const TimedStripe& s) { return s.pass == 1; });
  expect_refusal(problem, "passes: 2");
}

TEST(TimeOffset, RefusesASweepThatHardlySawTheStripe) {
  TimeOffsetProblem problem = GeneratedSweep{}.problem();
  for (TimedStripe& s : problem.recordings[0].stripes) s.points.resize(std::min<std::size_t>(1, s.points.size()));
  expect_refusal(problem, "both directions");
}

TEST(TimeOffset, RefusesJointsThatEndBeforeTheSweepComesBack) {
  TimeOffsetProblem problem = GeneratedSweep{}.problem();
  problem.recordings[0].joints.resize(100);
  expect_refusal(problem, "time offset: ");
  problem.recordings[0].joints.clear();
  expect_refusal(problem, "joint samples");
}

}  // namespace
}  // namespace tankrig
