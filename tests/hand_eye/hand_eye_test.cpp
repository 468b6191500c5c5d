#include "calibration/hand_eye/hand_eye.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "calibration/estimate/differentiable.hpp"
#include "core/input_error.hpp"
#include "tests/hand_eye/generated_postures.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;
using testing_support::GeneratedPostures;

double rotation_error(const Transform& a, const Transform& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear() * b.linear().transpose())).angle();
}

TEST(HandEye, IsExactOnPerfectViewsByEveryMethod) {
  GeneratedPostures set;
  set.corner_px = 0;
  const HandEyeSolution s = solve(set.problem());
  EXPECT_LT((s.cMb.translation() - set.cMb.translation()).norm(), 1e-7);
  EXPECT_LT(rotation_error(s.cMb, set.cMb), 1e-7);
  EXPECT_LT((s.eMg.translation() - set.eMg.translation()).norm(), 1e-7);
  EXPECT_LT(rotation_error(s.eMg, set.eMg), 1e-7);
  ASSERT_EQ(s.methods.size(), 8u);
  for (const HandEyeMethod& m : s.methods) {
    EXPECT_EQ(m.failure, "") << m.name;
    EXPECT_LT(m.at_target, 1e-4) << m.name;
  }
}

struct Conditions {
  const char* name;
  double corner_px, joint_rad, elbow_zero;
};
class Interval : public testing::TestWithParam<Conditions> {};

TEST_P(Interval, HoldsTheTruthAsOftenAsItSays) {
  const auto seeds = static_cast<unsigned>(testing_support::seeds(30));
  int held = 0, numbers = 0;
  double target = 0, sigma = 0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    GeneratedPostures set;
    set.seed = seed;
    set.corner_px = GetParam().corner_px;
    set.joint_rad = GetParam().joint_rad;
    set.elbow_zero = GetParam().elbow_zero;
    const HandEyeSolution s = solve(set.problem());
    std::vector<double> errors;
    for (const auto& [found, truth] : {std::pair{s.cMb, set.cMb}, std::pair{s.eMg, set.eMg}}) {
      const auto step = step_between(found, truth);
      errors.insert(errors.end(), step.begin(), step.end());
    }
    for (std::size_t k = 12; k < s.parameters.size(); ++k) {
      const std::string& name = s.parameters[k].name;
      errors.push_back(s.parameters[k].value - (name == "elbow zero" ? set.elbow_zero : 0));
    }
    for (std::size_t k = 0; k < errors.size(); ++k) {
      held += std::abs(errors[k]) <= s.parameters[k].half_width;
      ++numbers;
    }
    EXPECT_EQ(s.choices[set.elbow_zero > 0 ? 1 : 0].taken, true) << "seed " << seed << ": " << s.decision;
    target += (s.cMb * set.cMb.inverse() * Vector3d(0, 0, 1.1) - Vector3d(0, 0, 1.1)).squaredNorm() / seeds;
    sigma += s.target_sigma * s.target_sigma / seeds;
  }
  std::printf("%s: seeds 1..%u: target off by %.3f mm, sigma %.3f mm (rms); ", GetParam().name, seeds,
              1e3 * std::sqrt(target), 1e3 * std::sqrt(sigma));
  testing_support::expect_honest(held, numbers);
}

INSTANTIATE_TEST_SUITE_P(HandEye, Interval,
                         testing::Values(Conditions{"CornersAlone", 0.2, 0, 0}, Conditions{"JointsToo", 0.2, 1e-3, 0},
                                         Conditions{"ElbowZero", 0.2, 0.5e-3, 0.06}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(HandEye, DoesNotBlameTheJointsForWhatTheyCannotDo) {
  GeneratedPostures set;
  set.corner_px = 0.02;
  HandEyeProblem problem = set.problem();
  std::mt19937_64 random(set.seed);
  std::normal_distribution<double> noise(0, 1);
  for (HandEyeView& view : problem.views) {  // the whole marker is seen larger or smaller: no joint does that
    const double share = 1 + 0.01 * noise(random);
    Vector2d middle = Vector2d::Zero();
    for (const Vector2d& corner : view.corners) middle += corner / 4;
    for (Vector2d& corner : view.corners) corner = middle + share * (corner - middle);
  }
  const HandEyeSolution s = solve(problem);
  EXPECT_LT(s.joint_sigma, 0.01);
  EXPECT_LT(s.rms, 1);
}

TEST(HandEye, HasTheSameBitsEveryTime) {
  GeneratedPostures set;
  set.joint_rad = 1e-3;
  const HandEyeSolution a = solve(set.problem()), b = solve(set.problem());
  EXPECT_EQ(a.cMb.matrix(), b.cMb.matrix());
  EXPECT_EQ(a.covariance, b.covariance);
}

TEST(HandEye, PicksThePoseOfAFlatMarkerThatTheOtherViewsAgreeWith) {
  GeneratedPostures set;
  HandEyeProblem problem = set.problem();
  for (std::size_t i = 0; i < problem.views.size(); i += 3) {
    HandEyeView& v = problem.views[i];
    Transform flipped = v.cMg;
    flipped.linear() = Eigen::AngleAxisd(0.7, v.cMg.translation().unitOrthogonal()) * v.cMg.linear();
    v.cMg_flipped = v.cMg;
    v.cMg = flipped;
  }
  const HandEyeSolution s = solve(problem);
  EXPECT_THAT(s.flipped, testing::ElementsAre(0, 3, 6, 9, 12, 15, 18));
  EXPECT_LT((s.cMb.translation() - set.cMb.translation()).norm(), 5e-3);
  for (const HandEyeMethod& m : s.methods) EXPECT_LT(m.at_target, 0.02) << m.name;
}

TEST(HandEye, FindsAShoulderAndAnElbowThatStandElsewhereThanTheyRead) {
  GeneratedPostures set;
  set.shoulder_zero = -0.03;
  set.elbow_zero = 0.05;
  const HandEyeSolution s = solve(set.problem());
  ASSERT_EQ(s.parameters.size(), 14u);
  EXPECT_EQ(s.parameters[12].name, "shoulder zero");
  EXPECT_NEAR(s.parameters[12].value, -0.03, 2 * s.parameters[12].half_width);
  EXPECT_NEAR(s.parameters[13].value, 0.05, 2 * s.parameters[13].half_width);
  EXPECT_NEAR(s.arm.dh[2].theta0, set.true_arm().dh[2].theta0, 2 * s.parameters[13].half_width);
  EXPECT_LT(s.parameters[13].half_width, 3e-3);
  EXPECT_THAT(s.decision, HasSubstr("shoulder and elbow zero"));
  HandEyeProblem kept = set.problem();
  kept.refine_arm = false;
  EXPECT_GT(solve(kept).rms, 3 * s.rms);
}

TEST(HandEye, WorksOnPosesAlone) {
  GeneratedPostures set;
  HandEyeProblem problem = set.problem();
  problem.camera.reset();
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 1);
  for (HandEyeView& v : problem.views) {
    v.corners.clear();
    v.bMe = problem.arm.bMe(*v.q);
    v.q.reset();
    Eigen::Matrix<double, kPoseStep, 1> step;
    for (int k = 0; k < kPoseStep; ++k) step[k] = (k < 3 ? 2e-3 : 0.5e-3) * noise(random);
    v.cMg = moved(v.cMg, step.data());
  }
  const HandEyeSolution s = solve(problem);
  EXPECT_FALSE(s.pixels);
  for (int k = 0; k < kPoseStep; ++k)
    EXPECT_LT(std::abs(step_between(s.cMb, set.cMb)[k]), 2 * s.parameters[static_cast<std::size_t>(k)].half_width) << k;
}

TEST(HandEye, NamesAViewThatShowsAnotherPosture) {
  GeneratedPostures set;
  HandEyeProblem problem = set.problem();
  (*problem.views[4].q)[kElbow] += 0.2;
  const HandEyeSolution s = solve(problem);
  EXPECT_THAT(s.outliers, testing::ElementsAre(4));
  EXPECT_LT((s.cMb.translation() - set.cMb.translation()).norm(), 5e-3);
}

std::string refusal(const HandEyeProblem& problem) {
  return message_of<InputError>([&] { solve(problem); });
}

TEST(HandEye, RefusesASetThatDoesNotMoveAJointAndSaysWhich) {
  const auto without = [](std::initializer_list<Joint> still) {
    HandEyeProblem problem = GeneratedPostures{}.problem();
    for (HandEyeView& v : problem.views)
      for (const Joint joint : still) (*v.q)[joint] *= 0.02;
    return refusal(problem);
  };
  EXPECT_THAT(without({kSlew}), HasSubstr("slew is excited over"));
  EXPECT_THAT(without({kJawRotate}), HasSubstr("jaw_rotate is excited over"));
  EXPECT_THAT(without({kShoulder, kElbow}), HasSubstr("elbow (with shoulder) is excited over"));
}

TEST(HandEye, RefusesPosesThatTurnAboutOneAxis) {
  HandEyeProblem problem;
  for (int i = 0; i < 10; ++i) {
    HandEyeView v;
    v.name = "view";
    v.points = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0}};
    v.bMe = make_transform_rpy({0.1 * i, 0, 0}, {0, 0, 0.2 * i});
    v.cMg = make_transform({0, 0, 1}, {0, 0, 0, 1}) * v.bMe;
    problem.views.push_back(v);
  }
  EXPECT_THAT(refusal(problem), HasSubstr("about one axis"));
}

TEST(HandEye, RefusesJointsThatAreOnePictureOff) {
  HandEyeProblem problem = GeneratedPostures{}.problem();
  for (std::size_t i = 0; i + 1 < problem.views.size(); ++i) problem.views[i].q = problem.views[i + 1].q;
  problem.views.pop_back();
  EXPECT_THAT(refusal(problem), HasSubstr("1 place later"));
}

TEST(HandEye, RefusesJointsInNoOrder) {
  HandEyeProblem problem = GeneratedPostures{}.problem();
  std::mt19937_64 random(3);
  for (std::size_t i = problem.views.size() - 1; i > 0; --i)
    std::swap(problem.views[i].q, problem.views[random() % i].q);
  EXPECT_THAT(refusal(problem), HasSubstr("do not fit one place of the camera"));
}

TEST(HandEye, RefusesAnotherCamerasPictures) {
  HandEyeProblem problem = GeneratedPostures{}.problem();
  for (HandEyeView& v : problem.views)
    for (Vector2d& corner : v.corners) corner.x() = problem.camera->width - corner.x();
  for (HandEyeView& v : problem.views) v.cMg = Eigen::AngleAxisd(2, Vector3d::UnitX()) * v.cMg.inverse();
  EXPECT_NE(refusal(problem), "no error");
}

TEST(HandEye, RefusesAHandfulOfViews) {
  GeneratedPostures set;
  set.views = 5;
  EXPECT_THAT(refusal(set.problem()), HasSubstr("found 5 views"));
}

}  // namespace
}  // namespace tankrig
