#include "calibration/hand_eye/marker_error.hpp"

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>

#include <cmath>
#include <limits>
#include <memory>

#include "calibration/estimate/least_squares.hpp"

namespace tankrig {
namespace {

template <int... parameters>
using Cost = ceres::AutoDiffCostFunction<MarkerError, ceres::DYNAMIC, parameters...>;
using WholeCost = Cost<kPoseStep, kPoseStep, kDhNumbers, kPoseStep>;

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

template <class OfError>
OfError* cost_of(std::unique_ptr<MarkerError> error) {
  const int size = error->size();
  return new OfError(error.release(), size);
}

constexpr std::array<double, kPoseStep> kNoStep{};

template <int columns>
using Rows = Eigen::Matrix<double, Eigen::Dynamic, columns, Eigen::RowMajor>;

}  // namespace

std::optional<ViewErrors> view_errors(const HandEyeProblem& problem, const HandEyeView& view, const HandEyeState& state,
                                      const ChainNumbers& refined) {
  const std::unique_ptr<WholeCost> cost(cost_of<WholeCost>(error_of(problem, view, state)));
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
  if (!(*error)(kNoStep.data(), kNoStep.data(), residuals.data())) return std::numeric_limits<double>::infinity();
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
    if (refined.empty())
      least_squares.AddResidualBlock(cost_of<Cost<kPoseStep, kPoseStep>>(std::move(error)), loss, base.data(),
                                     gripper.data());
    else
      least_squares.AddResidualBlock(cost_of<Cost<kPoseStep, kPoseStep, kDhNumbers>>(std::move(error)), loss,
                                     base.data(), gripper.data(), state.chain.data());
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
