// The derivatives of a board's corner, put together from those of its steps, are those of the whole.
#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "calibration/intrinsics/reprojection.hpp"

namespace tankrig {
namespace {

void expect_true_derivatives(const std::optional<FlatPort>& port) {
  const RationalCamera camera{{640, 480, 610, 605, 322, 241, -0.21, 0.08, 1e-3, -2e-3, 0.02}, 0.03, -0.02, 0.01};
  CameraParameters lens = parameters_of(camera);
  PortParameters numbers = parameters_of(port.value_or(FlatPort{}));
  PoseNumbers kMc{0.1, -0.05, 0.02, -0.12, 0.01, 0.02}, cMt{-0.3, 0.2, 1.1, 0.05, -0.1, 0.9};
  double bend[]{1e-3, -2e-3};
  const BoardCorner corner({0.12, 0.05, 0}, {0.4, 0.9}, {300, 200}, port, 2.5);
  const double* const blocks[]{lens.data(), numbers.data(), kMc.data(), cMt.data(), bend};
  ceres::NumericDiffOptions numeric;
  numeric.ridders_relative_initial_step_size = 1e-3;  // from a hundredth its extrapolation is off by 4e-4 behind a port
  const std::vector<const ceres::Manifold*>* none = nullptr;
  const ceres::GradientChecker checker(&corner, none, numeric);
  ceres::GradientChecker::ProbeResults found;
  EXPECT_TRUE(checker.Probe(blocks, 1e-6, &found)) << found.error_log;
  EXPECT_GT(found.jacobians[3].norm(), 1e3) << "px per unit of the board's pose";
  Vector2d alone;
  ASSERT_TRUE(corner.Evaluate(blocks, alone.data(), nullptr));
  EXPECT_LT((alone - found.residuals).norm(), 1e-9) << "without derivatives";
}

TEST(BoardCorner, HasTheDerivativesOfItsError) { expect_true_derivatives({}); }

TEST(BoardCorner, HasTheDerivativesOfItsErrorBehindAPort) {
  expect_true_derivatives(FlatPort{0.03, 0.01, Vector3d(0.02, -0.03, 1).normalized()});
}

TEST(BoardCorner, IsRefusedBehindTheCamera) {
  CameraParameters lens = parameters_of(RationalCamera{{640, 480, 610, 605, 322, 241}});
  PortParameters port{};
  const PoseNumbers here{}, behind{0, 0, 0, 0, 0, -1};
  const double bend[2]{};
  const double* const blocks[]{lens.data(), port.data(), here.data(), behind.data(), bend};
  double error[2], by_lens[24], *jacobians[]{by_lens, nullptr, nullptr, nullptr, nullptr};
  const BoardCorner corner({0, 0, 0}, {0, 0}, {300, 200}, {});
  EXPECT_FALSE(corner.Evaluate(blocks, error, nullptr));
  EXPECT_FALSE(corner.Evaluate(blocks, error, jacobians));
}

}  // namespace
}  // namespace tankrig
