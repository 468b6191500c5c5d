// The joint refinement on rigs whose truth is known: no worse than the steps, honest intervals, and the camera that was knocked.
#include "calibration/joint/joint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <map>

#include "calibration/intrinsics/reprojection.hpp"
#include "core/input_error.hpp"
#include "tests/joint/generated_rig.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;
using namespace testing_support;

GeneratedRig generated(unsigned seed, bool ports = false) {
  GeneratedRig rig;
  rig.seed = seed;
  if (ports) rig.put_behind_ports();
  rig.generate();
  return rig;
}

/// True values of what is looked for, by name. Of the laser: with what the sweep's joints are off by, taken up by the plane.
std::map<std::string, double> true_numbers(const GeneratedRig& rig, const JointProblem& problem,
                                           const JointSolution& found) {
  std::map<std::string, double> out;
  const auto add_pose = [&](const std::string& name, const Transform& pose) {
    const PoseNumbers numbers = numbers_of(pose);
    for (int i = 0; i < 6; ++i)
      out[name + (i < 3 ? " rotation " : " translation ") + "xyz"[i % 3]] = numbers[static_cast<std::size_t>(i)];
  };
  for (const Eye eye : {kLeft, kMono, kRight}) {
    const CameraParameters lens = parameters_of({rig.lenses[eye]});
    for (std::size_t i = 0; i < lens.size(); ++i) out[kEyes[eye] + " " + kCameraParameterNames[i]] = lens[i];
    const PortParameters port = parameters_of(rig.lenses[eye].port.value_or(FlatPort()));
    for (std::size_t i = 0; i < port.size(); ++i) out[kEyes[eye] + " " + kPortParameterNames[i]] = port[i];
    if (eye != kMono) add_pose("mono in " + kEyes[eye], rig.bMk[eye].inverse() * rig.bMk[kMono]);
  }
  add_pose("base in mono", rig.bMk[kMono].inverse());
  add_pose("marker in gripper", rig.eMg);
  const ArmModel arm = rig.true_arm();
  for (const int joint : {1, 2})
    out[std::string(kJointNames[static_cast<std::size_t>(joint)]) + " zero"] =
        arm.dh[static_cast<std::size_t>(joint)].theta0 - problem.arm.dh[static_cast<std::size_t>(joint)].theta0;
  JointVector q = JointVector::Zero();
  double stripes = 0;
  for (const SheetBoard& sheet : problem.sheets)
    for (const BoardStripe& stripe : sheet.stripes) q += stripe.q, ++stripes;
  q /= stripes;
  const Plane ePl = arm.bMe(q).inverse() * arm.bMe(q + rig.sweep_off) * rig.ePl;
  const double along = ePl.normal.dot(found.axis_u.cross(found.axis_v));
  out["laser tilt u"] = ePl.normal.dot(found.axis_u) / along;
  out["laser tilt v"] = ePl.normal.dot(found.axis_v) / along;
  out["laser distance"] = ePl.distance(found.centre);
  out["mono delay"] = rig.delay;
  return out;
}

struct Study {
  int held = 0, all = 0, better = 0;
  double steps = 0, joint = 0, steps_base = 0, joint_base = 0, steps_stereo = 0, joint_stereo = 0, sigma = 0;
  std::map<std::string, int> missed;
};

Study study(unsigned first, unsigned seeds, bool ports = false) {
  Study out;
  for (unsigned seed = first; seed < first + seeds; ++seed) {
    const GeneratedRig rig = generated(seed, ports);
    const SteppedCalibration steps = by_steps(rig);
    const JointSolution joint = solve(steps.problem);
    const auto before = rig.judge(steps.believed), after = rig.judge(believed(joint));
    out.better += after.laser < before.laser;
    const auto add = [seeds](double& sum, double value) { sum += value * value / seeds; };
    add(out.steps, before.laser), add(out.joint, after.laser);
    add(out.steps_base, before.laser_in_base), add(out.joint_base, after.laser_in_base);
    add(out.steps_stereo, before.stereo), add(out.joint_stereo, after.stereo);
    add(out.sigma, joint.laser_sigma);
    const auto truth = true_numbers(rig, steps.problem, joint);
    for (const Estimate& e : joint.parameters) {
      const bool held = std::abs(e.value - truth.at(e.name)) <= e.half_width;
      out.held += held, ++out.all;
      out.missed[e.name] += !held;
    }
    EXPECT_LT(joint.discrepancies.front().sigmas, kMostSigmas)
        << "seed " << seed << ": " << joint.discrepancies.front().name;
  }
  for (double* sum :
       {&out.steps, &out.joint, &out.steps_base, &out.joint_base, &out.steps_stereo, &out.joint_stereo, &out.sigma})
    *sum = 1e3 * std::sqrt(*sum);
  std::printf(
      "seeds %u to %u: rms off the object, steps and joint: laser %.3f, %.3f mm (better in %d); in the arm's base "
      "%.3f, %.3f mm; stereo %.3f, %.3f mm; laser's sigma %.3f mm; %d of %d 95 %% intervals hold the truth (%.1f %%)\n",
      first, first + seeds - 1, out.steps, out.joint, out.better, out.steps_base, out.joint_base, out.steps_stereo,
      out.joint_stereo, out.sigma, out.held, out.all, 100.0 * out.held / out.all);
  for (const auto& [name, missed] : out.missed)
    if (missed * 6 > static_cast<int>(seeds)) std::printf("  %s: missed in %d\n", name.c_str(), missed);
  return out;
}

TEST(Joint, IsNoWorseThanTheSteps) {
  const Study s = study(1, 3);
  EXPECT_LE(s.joint, s.steps);
  EXPECT_LE(s.joint_base, 1.05 * s.steps_base);
  EXPECT_LE(s.joint_stereo, 1.05 * s.steps_stereo);
}

TEST(JointStudy, IsNoWorseThanTheStepsAndItsIntervalsHoldTheTruth) {
  const Study s = study(101, 30);
  EXPECT_LE(s.joint, s.steps);
  EXPECT_LE(s.joint_base, s.steps_base);
  EXPECT_LE(s.joint_stereo, 1.02 * s.steps_stereo);
  EXPECT_GE(s.held, 0.90 * s.all);
  EXPECT_LE(s.held, 0.99 * s.all);
}

TEST(Joint, FindsThePortsThatItLooksThrough) {
  const Study s = study(1, static_cast<unsigned>(seeds(15)), true);
  EXPECT_LE(s.joint_base, 1.05 * s.steps_base);
  EXPECT_LE(s.joint_stereo, 1.05 * s.steps_stereo);
  expect_honest(s.held, s.all);
}

void print(const Discrepancy& d) {
  const Discrepancy::Size size = d.size.value_or(Discrepancy::Size());
  std::printf("%s: %.1f sigmas, %.2f mm, %.2f mrad (0: not told)\n", d.name.c_str(), d.sigmas, 1e3 * size.moved,
              1e3 * size.turned);
}

TEST(Joint, NamesTheCameraThatWasKnockedBetweenBoardsAndMarker) {
  GeneratedRig rig;
  for (const Eye eye : {kLeft, kRight}) rig.lenses[eye].fx = 430, rig.lenses[eye].fy = 428;  // they see the marker, too
  rig.left_knock = make_transform_rpy({0.003, 0, 0.001}, {0.004, -0.003, 0});
  rig.generate();
  const JointSolution joint = solve(by_steps(rig).problem);
  const Discrepancy& worst = joint.discrepancies.front();
  print(worst);
  EXPECT_EQ(worst.name, "left, between boards and marker");
  EXPECT_GT(worst.sigmas, kMostSigmas);
  ASSERT_TRUE(worst.size);
  EXPECT_NEAR(worst.size->turned, 0.005, 0.002);
}

TEST(Joint, NamesTheCameraThatWasKnockedBetweenMarkerAndSheet) {
  GeneratedRig rig;
  rig.mono_knock = make_transform_rpy({0, 0.02, 0}, {0.05, 0, 0.05});
  rig.generate();
  const JointSolution joint = solve(by_steps(rig).problem);
  const Discrepancy& worst = joint.discrepancies.front();
  print(worst);
  EXPECT_EQ(worst.name, "mono, or the arm, between marker and sheet");
  EXPECT_GT(worst.sigmas, kMostSigmas);
  // Stripes tell how their plane has moved, not where the camera stands now.
  EXPECT_FALSE(worst.size);
}

JointProblem there_and_back(unsigned seed, double delay) {
  GeneratedRig rig;
  rig.seed = seed, rig.delay = delay, rig.back = true;
  rig.generate();
  JointProblem problem = by_steps(rig).problem;
  problem.delay.reset();
  return problem;
}

const Estimate& delay_of(const JointSolution& found) { return *found.parameter("mono delay"); }

/// The boards alone tell it, from their stripes there and back: no sweep over the object has.
TEST(Joint, FindsTheDelayByIntervalsThatHoldIt) {
  constexpr double kDelay = 4e-3;
  const int rigs = seeds(30);
  int held = 0;
  double squares = 0, variances = 0;
  for (int seed = 1; seed <= rigs; ++seed) {
    const Estimate found = delay_of(solve(there_and_back(static_cast<unsigned>(seed), kDelay)));
    const double error = found.value - kDelay;
    held += std::abs(error) <= found.half_width;
    squares += error * error / rigs, variances += found.sigma * found.sigma / rigs;
    EXPECT_LT(std::abs(error), 0.25 * kDelay) << "seed " << seed;
    EXPECT_GT(found.effect, 0) << "seed " << seed;
  }
  std::printf("seeds 1..%d: the delay is off by %.4f ms, sigma %.4f ms (both rms); ", rigs, 1e3 * std::sqrt(squares),
              1e3 * std::sqrt(variances));
  expect_honest(held, rigs);
}

TEST(Joint, WeighsTheSweepsDelayAgainstThatOfTheStripes) {
  JointProblem problem = there_and_back(2, 4e-3);
  const Estimate stripes = delay_of(solve(problem));
  const auto with_sweep = [&](double sigmas) {  // of the stripes', three of which it is off
    problem.delay = SweepDelay{stripes.value + 3 * stripes.sigma, sigmas * stripes.half_width};
    return delay_of(solve(problem));
  };
  const Estimate sure = with_sweep(0.05), alike = with_sweep(1), unsure = with_sweep(20);
  EXPECT_NEAR(sure.value, stripes.value + 3 * stripes.sigma, 0.1 * stripes.sigma);
  EXPECT_LT(sure.sigma, 0.1 * stripes.sigma);
  EXPECT_GT(alike.value, stripes.value + 0.5 * stripes.sigma);
  EXPECT_LT(alike.value, stripes.value + 2.5 * stripes.sigma);
  EXPECT_LT(alike.sigma, 0.9 * stripes.sigma);
  EXPECT_GT(alike.sigma, M_SQRT1_2 * stripes.sigma) << "no weights make it surer";
  EXPECT_NEAR(unsure.value, stripes.value, 0.1 * stripes.sigma);
  EXPECT_NEAR(unsure.sigma, stripes.sigma, 0.05 * stripes.sigma);
}

TEST(Joint, KeepsTheSweepsDelayWhereStripesGoOneWay) {
  GeneratedRig rig;
  rig.seed = 3, rig.delay = 4e-3;
  rig.generate();
  JointProblem problem = by_steps(rig).problem;
  const JointSolution found = solve(problem);
  EXPECT_NEAR(delay_of(found).value, rig.swept.value, 1e-3 * rig.swept.half_width);
  EXPECT_NEAR(delay_of(found).half_width, rig.swept.half_width, 1e-3 * rig.swept.half_width);
  // A scan that way meets the plane where it was found, whatever the delay.
  const double known = found.laser_sigma;
  problem.delay->half_width *= 20;
  EXPECT_NEAR(solve(problem).laser_sigma, known, 0.02 * known);
  problem.delay.reset();
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }), HasSubstr("the data leaves mono delay open"));
}

TEST(Joint, RefusesADelayThatJointsAtRestCannotTell) {
  JointProblem problem = there_and_back(4, 0);
  for (SheetBoard& sheet : problem.sheets)
    for (BoardStripe& stripe : sheet.stripes) stripe.velocity.setZero();
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }), HasSubstr("the data leaves mono delay open"));
}

TEST(Joint, LeavesOutStripesOfReflections) {
  SteppedCalibration steps = by_steps(generated(5));
  for (std::size_t i = 3; i < steps.problem.sheets[0].stripes.size(); i += 12)
    for (Vector2d& pixel : steps.problem.sheets[0].stripes[i].pixels) pixel += Vector2d(9, -9);
  const std::size_t wrong = (steps.problem.sheets[0].stripes.size() + 8) / 12;
  const JointSolution joint = solve(steps.problem);
  EXPECT_GE(joint.strays, wrong);
  EXPECT_LE(joint.strays, wrong + 3);
  EXPECT_LT(joint.rms, 1e-3);
}

TEST(Joint, HasTheSameBitsEveryTime) {
  const JointProblem problem = by_steps(generated(6)).problem;
  const JointSolution a = solve(problem), b = solve(problem);
  EXPECT_EQ(a.cMb.matrix(), b.cMb.matrix());
  EXPECT_EQ(a.ePl.normal, b.ePl.normal);
  EXPECT_EQ(a.covariance, b.covariance);
}

TEST(Joint, SaysWhatIsMissing) {
  const JointProblem whole = by_steps(generated(7)).problem;
  const auto refusal = [&](const std::function<void(JointProblem&)>& spoil) {
    JointProblem problem = whole;
    spoil(problem);
    return message_of<InputError>([&] { solve(problem); });
  };
  EXPECT_THAT(refusal([](JointProblem& p) { p.postures.resize(5); }),
              HasSubstr("mono sees the marker in 5 postures, expected 6 at least"));
  EXPECT_THAT(refusal([](JointProblem& p) {
                for (MarkerPosture& posture : p.postures) posture.q[kElbow] = 1.4;
              }),
              HasSubstr("found an elbow that moves by 0.0 deg from posture to posture, expected 5 at least"));
  EXPECT_THAT(refusal([](JointProblem& p) {
                for (SheetBoard& sheet : p.sheets)
                  for (BoardStripe& stripe : sheet.stripes) stripe.q[kElbow] = 1.5;
              }),
              HasSubstr("found an elbow that moves by 0.0 deg from stripe to stripe, expected 5 at least"));
  EXPECT_THAT(refusal([](JointProblem& p) { p.sheets.pop_back(); }),
              HasSubstr("found 1 boards under the stripe, expected 2 at least"));
  EXPECT_THAT(refusal([](JointProblem& p) { p.sheets[1].stripes.resize(4); }),
              HasSubstr("board 2: found 4 stripes, expected 10 at least"));
  EXPECT_THAT(refusal([](JointProblem& p) { p.delay->half_width = 0; }), HasSubstr("found a delay known to 0 s"));
  EXPECT_THAT(refusal([](JointProblem& p) { p.sheets[0].corners.pop_back(); }),
              HasSubstr("board 1: found 53 corners of 54"));
  EXPECT_THAT(refusal([](JointProblem& p) { p.boards.views.resize(2), p.boards.cMt.resize(2); }),
              HasSubstr("found 2 boards, expected 3 at least"));
}

}  // namespace
}  // namespace tankrig
