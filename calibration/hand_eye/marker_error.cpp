#include "calibration/hand_eye/marker_error.hpp"

#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>

#include <cmath>
#include <limits>
#include <memory>

#include "calibration/estimate/least_squares.hpp"

namespace tankrig {
namespace {

std::unique_ptr<MarkerError> error_of(const HandEyeProblem& problem, const HandEyeView& view,
                                      const HandEyeState& state) {
  auto error = std::make_unique<MarkerError>();
  error->problem = &problem;
  error->view = &view;
  error->cMb = state.cMb;
  error->eMg = state.eMg;
  error->bMe = view.q ? end_effector(problem.arm, *view.q, state.chain.data()) : view.bMe;
  return error;
}

/// Derivatives by a few parameters at a time, whatever their number: one type of numbers to compile.
std::unique_ptr<ceres::CostFunction> cost_of(std::unique_ptr<MarkerError> error, MarkerBlock last) {
  error->last = last;
  const int size = error->size();
  auto cost = std::make_unique<ceres::DynamicAutoDiffCostFunction<MarkerError, kPoseStep>>(error.release());
  for (const int block : {kPoseStep, kPoseStep, kDhNumbers, kPoseStep})
    if (static_cast<int>(cost->parameter_block_sizes().size()) <= static_cast<int>(last))
      cost->AddParameterBlock(block);
  cost->SetNumResiduals(size);
  return cost;
}

constexpr std::array<double, kPoseStep> kNoStep{};

template <int columns>
using Rows = Eigen::Matrix<double, Eigen::Dynamic, columns, Eigen::RowMajor>;

}  // namespace

std::optional<ViewErrors> view_errors(const HandEyeProblem& problem, const HandEyeView& view, const HandEyeState& state,
                                      const ChainNumbers& refined) {
  const auto cost = cost_of(error_of(problem, view, state), MarkerBlock::kView);
  const int size = cost->num_residuals();
  ViewErrors out;
  out.residuals.resize(size);
  Rows<kPoseStep> base(size, kPoseStep), gripper(size, kPoseStep), own(size, kPoseStep);
  Rows<kDhNumbers> chain(size, kDhNumbers);
  const double* parameters[] = {kNoStep.data(), kNoStep.data(), state.chain.data(), kNoStep.data()};
  double* jacobians[] = {base.data(), gripper.data(), chain.data(), own.data()};
  if (!cost->Evaluate(parameters, out.residuals.data(), jacobians)) return std::nullopt;
  out.by_state.resize(size, 2 * kPoseStep + static_cast<Eigen::Index>(refined.size()));
  out.by_state << base, gripper, chain(Eigen::all, refined);
  out.by_view = view.q ? Eigen::MatrixXd(own.leftCols(4)) : Eigen::MatrixXd(own);
  return out;
}

double view_rms(const HandEyeProblem& problem, const HandEyeView& view, const HandEyeState& state) {
  const std::unique_ptr<MarkerError> error = error_of(problem, view, state);
  Eigen::VectorXd residuals(error->size());
  const double* parameters[] = {kNoStep.data(), kNoStep.data()};
  if (!(*error)(parameters, residuals.data())) return std::numeric_limits<double>::infinity();
  return residuals.norm() / std::sqrt(static_cast<double>(view.points.size()));
}

void minimise(const HandEyeProblem& problem, const std::vector<std::size_t>& views, const ChainNumbers& refined,
              const std::vector<Eigen::MatrixXd>& whiten, double robust_scale, HandEyeState& state) {
  std::array<double, kPoseStep> base{}, gripper{};
  ceres::Problem least_squares;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const HandEyeView& view = problem.views[views[k]];
    const double points = std::sqrt(static_cast<double>(view.points.size()));
    auto error = error_of(problem, view, state);
    if (!whiten.empty()) error->whiten = whiten[k];
    ceres::LossFunction* const loss = robust_scale > 0 ? new ceres::CauchyLoss(robust_scale * points) : nullptr;
    std::vector<double*> blocks{base.data(), gripper.data()};
    if (!refined.empty()) blocks.push_back(state.chain.data());
    const MarkerBlock last = refined.empty() ? MarkerBlock::kGripper : MarkerBlock::kChain;
    least_squares.AddResidualBlock(cost_of(std::move(error), last).release(), loss, blocks);
  }
  if (!refined.empty()) {
    std::vector<int> constant;
    for (int k = 0; k < kDhNumbers; ++k)
      if (std::find(refined.begin(), refined.end(), k) == refined.end()) constant.push_back(k);
    least_squares.SetManifold(state.chain.data(), new ceres::SubsetManifold(kDhNumbers, constant));
  }
  minimise(least_squares, "hand-eye");
  state.cMb = moved(state.cMb, base.data());
  state.eMg = moved(state.eMg, gripper.data());
}

}  // namespace tankrig
