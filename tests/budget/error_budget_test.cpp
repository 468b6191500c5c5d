// A budget is what errors of that size truly cost.
#include "calibration/budget/error_budget.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "calibration/intrinsics/board_bundle.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

/// Camera at `eye` that looks at `target`, image rows level.
Transform look_at(const Vector3d& eye, const Vector3d& target) {
  const Vector3d z = (target - eye).normalized(), x = z.cross(-Vector3d::UnitZ()).normalized();
  Transform bMc = Transform::Identity();
  bMc.linear() << x, z.cross(x), z;
  bMc.translation() = eye;
  return bMc;
}

MeasuringRig some_rig() {
  const Vector3d box(-0.26, 0.025, 1.02);
  MeasuringRig rig;
  rig.mono = {"mono", {720, 576, 626, 683, 369, 285, -0.37, 0.17, 0, 0, 0}, look_at({0.716, 0.228, 0.585}, box)};
  rig.left = {"left", {640, 480, 765, 763, 316, 237}, look_at({0.575, 0.215, 0.57}, box)};
  rig.right = {"right", rig.left->model, rig.left->bMc * Eigen::Translation3d(0.088, 0, 0)};
  rig.arm = arm5e();
  rig.ePl = {Vector3d::UnitX(), 0.09796};
  return rig;
}

BudgetSweep some_sweep() {
  BudgetSweep sweep;
  sweep.posture << 0, 0.13, 1.3, 0, 0.1;
  sweep.from = 1.3, sweep.to = 2.1, sweep.velocity = 0.1;
  return sweep;
}

/// A patch of a surface that faces the camera.
std::vector<BudgetTarget> some_targets() {
  std::vector<BudgetTarget> targets;
  const Vector3d normal = Vector3d(0.5, 0.1, -0.85).normalized();
  const Vector3d u = normal.cross(Vector3d::UnitY()).normalized(), v = normal.cross(u);
  for (double a = -0.08; a <= 0.08; a += 0.04)
    for (double b = -0.08; b <= 0.08; b += 0.04)
      targets.push_back({Vector3d(-0.26, 0.025, 1.02) + a * u + b * v, normal});
  return targets;
}

const BudgetLine& line_of(const Budget& budget, const std::string& name) {
  for (const BudgetLine& line : budget.lines)
    if (line.name == name) return line;
  throw std::runtime_error("no line " + name);
}

TEST(ErrorBudget, AMilliradianOfTheLaserCostsAMillimetre) {
  Calibration calibration;
  calibration.laser = CalibratedLaser{};
  calibration.laser->sigma_rad = 1e-3;
  const MeasuringRig rig = some_rig();
  const Budget budget =
      error_budget(rig, some_sweep(), some_targets(), uncertainties_of(rig, &calibration, some_sweep(), {}));
  const BudgetLine& line = line_of(budget, "laser: direction");
  EXPECT_TRUE(line.measured);
  EXPECT_EQ(line.sigma, "1 mrad");
  EXPECT_GT(*line.laser, 0.6e-3);
  EXPECT_LT(*line.laser, 2e-3);
  EXPECT_FALSE(line.stereo) << "the stereo method has no laser";
  EXPECT_FALSE(line_of(budget, "mono: position").stereo);
  EXPECT_FALSE(line_of(budget, "left: position").laser);
  EXPECT_EQ(budget.laser_targets, some_targets().size());
}

MeasuringRig rig_behind_ports() {
  MeasuringRig rig = some_rig();
  rig.mono.model.port = rig.left->model.port = FlatPort{0.03, 0.01, Vector3d(0.02, -0.01, 1).normalized()};
  return rig;
}

TEST(ErrorBudget, HasARowForEachPortAndNoneForACameraWithout) {
  const MeasuringRig rig = rig_behind_ports();
  Calibration calibration;
  CalibratedLens& lens = calibration.camera("mono").lens.emplace();
  lens.sigma = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1e-4, 4e-4, 2e-4};
  const Budget budget =
      error_budget(rig, some_sweep(), some_targets(), uncertainties_of(rig, &calibration, some_sweep(), {}));
  const BudgetLine &mono = line_of(budget, "mono: flat port"), &left = line_of(budget, "left: flat port");
  EXPECT_TRUE(mono.measured);
  EXPECT_EQ(mono.sigma, "0.1 mm, 0.4 mrad");
  EXPECT_FALSE(mono.stereo) << "the eyes have ports of their own";
  EXPECT_FALSE(left.measured);
  EXPECT_EQ(left.sigma, "5 mm, 18 mrad");
  EXPECT_FALSE(left.laser);
  EXPECT_THROW(line_of(budget, "right: flat port"), std::runtime_error);
}

/// Measures through a port that is off by a sigma, everything seen as it is.
TEST(ErrorBudget, APortCostsWhatPlacesSeenThroughAnotherOneAreOff) {
  const MeasuringRig rig = rig_behind_ports();
  const auto off = [&](const PortParameters& by) {
    MeasuringRig believed = rig;
    PortParameters numbers = parameters_of(*rig.mono.model.port);
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] += by[i];
    believed.mono.model.port = port_of(*rig.mono.model.port, numbers);
    return misplacement(rig, believed, Transform::Identity(), some_sweep(), some_targets()).laser.rms;
  };
  constexpr PortParameters kSigma{1e-4, 4e-4, 2e-4};
  Calibration calibration;
  CalibratedLens& lens = calibration.camera("mono").lens.emplace();
  lens.sigma = {0, 0, 0, 0, 0, 0, 0, 0, 0, kSigma[0], kSigma[1], kSigma[2]};
  const Budget budget =
      error_budget(rig, some_sweep(), some_targets(), uncertainties_of(rig, &calibration, some_sweep(), {}));
  const double expected = std::hypot(off({kSigma[0], 0, 0}), off({0, kSigma[1], 0}), off({0, 0, kSigma[2]}));
  EXPECT_GT(expected, 1e-6);
  EXPECT_NEAR(*line_of(budget, "mono: flat port").laser, expected, 0.01 * expected);
}

TEST(ErrorBudget, ATimeOffsetIsAnAngleOfTheElbow) {
  const MeasuringRig rig = some_rig();
  const Budget budget =
      error_budget(rig, some_sweep(), some_targets(), uncertainties_of(rig, nullptr, some_sweep(), {}));
  const double late = *line_of(budget, "mono: time offset").laser, elbow = *line_of(budget, "elbow: zero").laser;
  EXPECT_NEAR(late / elbow, 0.1 * 0.02 / 0.0087, 1e-6);
  EXPECT_FALSE(line_of(budget, "mono: time offset").measured);
}

TEST(ErrorBudget, BringsTheCostliestFirstAndAddsSquares) {
  const MeasuringRig rig = some_rig();
  const Budget budget =
      error_budget(rig, some_sweep(), some_targets(), uncertainties_of(rig, nullptr, some_sweep(), {}));
  double laser = 0, stereo = 0, before = 1;
  for (const BudgetLine& line : budget.lines) {
    EXPECT_LE(line.worst(), before);
    before = line.worst();
    laser += std::pow(line.laser.value_or(0), 2), stereo += std::pow(line.stereo.value_or(0), 2);
  }
  EXPECT_NEAR(budget.laser, std::sqrt(laser), 1e-12);
  EXPECT_NEAR(budget.stereo, std::sqrt(stereo), 1e-12);
}

TEST(ErrorBudget, ACalibrationsSigmasOfTheRightEyeAreAlongTheLeftOnesAxes) {
  const MeasuringRig rig = some_rig();
  Calibration calibration;
  calibration.stereo.emplace();
  calibration.stereo->sigma_m = {1e-4, 2e-4, 3e-4};
  calibration.stereo->sigma_rad = {4e-4, 5e-4, 6e-4};
  const Vector3d centre = rig.right->bMc.translation();
  for (const Uncertainty& uncertainty : uncertainties_of(rig, &calibration, some_sweep(), {})) {
    if (!uncertainty.name.starts_with("right in left")) continue;
    const bool turned = uncertainty.name.ends_with("direction");
    ASSERT_EQ(uncertainty.freedoms.size(), 3u);
    for (int k = 0; k < 3; ++k) {
      const Freedom& freedom = uncertainty.freedoms[k];
      MeasuringRig changed = rig;
      JointVector q = some_sweep().posture;
      freedom.change(changed, q, freedom.sigma);
      const Eigen::AngleAxisd turn(changed.right->bMc.linear() * rig.right->bMc.linear().transpose());
      const Vector3d change =
          turned ? Vector3d(turn.angle() * turn.axis()) : Vector3d(changed.right->bMc.translation() - centre);
      const Vector3d along = (k + (turned ? 4 : 1)) * 1e-4 * rig.left->bMc.linear().col(k);
      EXPECT_LT((change - along).norm(), 1e-9) << uncertainty.name << " " << k;
    }
  }
}

/// Draws every freedom at random, small, and measures as the rig would that believes it.
TEST(ErrorBudget, IsWhatRandomErrorsCost) {
  constexpr std::uint64_t kSeed = 7;
  constexpr double kSmall = 0.02;  // of every sigma: the budget is linear
  constexpr int kDraws = 4000;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal(0, 1);
  const MeasuringRig rig = some_rig();
  const BudgetTarget target = some_targets()[7];
  const auto uncertainties = uncertainties_of(rig, nullptr, some_sweep(), {});
  const Budget budget = error_budget(rig, some_sweep(), {target}, uncertainties);

  // The elbow at which the sheet passes the target, found by another way than the budget's.
  JointVector q = some_sweep().posture;
  for (int i = 0; i < 50; ++i) {
    const double f = rig.ePl.distance(rig.arm.bMe(q).inverse() * target.p);
    JointVector more = q;
    more[kElbow] += 1e-6;
    q[kElbow] -= f / ((rig.ePl.distance(rig.arm.bMe(more).inverse() * target.p) - f) / 1e-6);
  }
  const Vector2d pixel = *rig.mono.model.project(rig.mono.bMc.inverse() * target.p);
  double squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    MeasuringRig believed = rig;
    JointVector believed_q = q;
    for (const Uncertainty& uncertainty : uncertainties)
      for (const Freedom& freedom : uncertainty.freedoms)
        freedom.change(believed, believed_q, kSmall * freedom.sigma * normal(random));
    const Plane cPl = believed.mono.bMc.inverse() * (believed.arm.bMe(believed_q) * believed.ePl);
    const Vector3d ray = believed.mono.model.ray(pixel.x(), pixel.y());
    const Vector3d p = believed.mono.bMc * Vector3d(-cPl.offset / cPl.normal.dot(ray) * ray);
    squares += std::pow(target.normal.dot(p - target.p), 2);
  }
  EXPECT_NEAR(std::sqrt(squares / kDraws) / (kSmall * budget.laser), 1, 0.05);
}

TEST(ErrorBudget, NamesThePartThatNominalValuesHaveWrong) {
  const MeasuringRig measured = some_rig();
  MeasuringRig nominal = measured;
  nominal.arm.dh[kElbow].theta0 += 0.01;
  const Budget budget =
      error_budget(measured, some_sweep(), some_targets(), differences_of(measured, nominal, 0, some_sweep()));
  EXPECT_EQ(budget.lines.front().name, "elbow: zero");
  EXPECT_EQ(budget.lines.front().sigma, "0.57 degrees");
  EXPECT_NEAR(budget.laser, *budget.lines.front().laser, 1e-9);

  MeasuringRig turned = measured;
  const Transform change(Eigen::AngleAxisd(0.02, Vector3d::UnitX()));
  turned.left->bMc = turned.left->bMc * change;
  turned.right->bMc = turned.left->bMc * (measured.left->bMc.inverse() * measured.right->bMc);
  const Budget stereo =
      error_budget(measured, some_sweep(), some_targets(), differences_of(measured, turned, 0, some_sweep()));
  EXPECT_EQ(stereo.lines.front().name, "left: direction");
  EXPECT_FALSE(stereo.lines.front().laser);
  EXPECT_LT(line_of(stereo, "right in left: position").stereo.value_or(0), 1e-9) << "both eyes moved together";
}

TEST(ErrorBudget, NamesThePortThatNominalValuesHaveWrong) {
  const MeasuringRig measured = rig_behind_ports();
  MeasuringRig nominal = measured;
  nominal.mono.model.port->distance += 0.005;
  const Budget budget =
      error_budget(measured, some_sweep(), some_targets(), differences_of(measured, nominal, 0, some_sweep()));
  EXPECT_EQ(budget.lines.front().name, "mono: lens");
  EXPECT_GT(*budget.lines.front().laser, 1e-4);
}

TEST(Misplacement, IsNoneOfTheTruthAndTheShiftOfARigThatIsTakenForAnother) {
  const MeasuringRig rig = some_rig();
  const auto of = [&](const MeasuringRig& believed, const Transform& bMbelieved) {
    return misplacement(rig, believed, bMbelieved, some_sweep(), some_targets());
  };
  const Misplacement none = of(rig, Transform::Identity());
  EXPECT_EQ(none.laser.places, some_targets().size());
  EXPECT_LT(none.laser.rms, 1e-9);
  EXPECT_LT(none.stereo.rms, 1e-9);
  // Cameras and laser all moved along the surface's normal by 3 mm: so do the places.
  const Vector3d shift = 0.003 * some_targets().front().normal;
  const Misplacement moved = of(rig, Transform(Eigen::Translation3d(shift)));
  EXPECT_NEAR(moved.laser.mean, 0.003, 1e-9);
  EXPECT_NEAR(moved.stereo.rms, 0.003, 1e-9);
  // A lens alone concerns only what uses it.
  MeasuringRig other = rig;
  other.mono.model.cx += 2;
  EXPECT_GT(of(other, Transform::Identity()).laser.rms, 1e-4);
  EXPECT_LT(of(other, Transform::Identity()).stereo.rms, 1e-9);
}

TEST(ErrorBudget, SaysIfNothingIsSeen) {
  const MeasuringRig rig = some_rig();
  std::vector<BudgetTarget> away = some_targets();
  for (BudgetTarget& target : away) target.normal = -target.normal;
  EXPECT_THROW(error_budget(rig, some_sweep(), away, uncertainties_of(rig, nullptr, some_sweep(), {})), InputError);
}

}  // namespace
}  // namespace tankrig
