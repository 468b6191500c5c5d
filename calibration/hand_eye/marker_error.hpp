// The least-squares problem of hand-eye calibration: where a view's marker points are expected, less where they were seen.
#pragma once

#include <optional>

#include "calibration/estimate/differentiable.hpp"
#include "calibration/hand_eye/hand_eye.hpp"

namespace tankrig {

/// What an error depends on, blocks of parameters in this order.
enum class MarkerBlock { kBase, kGripper, kChain, kView };

/// Residuals of one view, for Ceres: px, or m where there are no corners. Parameters: steps of cMb and eMg; then, up to
/// the `last` block, what is added to the arm's chain, and what is added to this view's joints (the first four) or,
/// without joints, a step of its bMe. Without those, bMe is as the state has it.
struct MarkerError {
  const HandEyeProblem* problem = nullptr;
  const HandEyeView* view = nullptr;
  Transform cMb = Transform::Identity(), eMg = Transform::Identity(), bMe = Transform::Identity();
  std::optional<Eigen::MatrixXd> whiten;     ///< multiplies the residuals
  MarkerBlock last = MarkerBlock::kGripper;  ///< of the blocks that there are

  int per_point() const { return view->corners.empty() ? 3 : 2; }
  int size() const { return per_point() * static_cast<int>(view->points.size()); }

  template <class T>
  bool operator()(T const* const* parameters, T* out) const {
    return of(parameters[0], parameters[1], end_effector_of<T>(parameters), out);
  }

  template <class T>
  TransformOf<T> end_effector_of(T const* const* parameters) const {
    if (last < MarkerBlock::kChain) return TransformOf<T>(bMe.cast<T>());
    const T* chain = parameters[2];
    if (last < MarkerBlock::kView) return end_effector(problem->arm, *view->q, chain);
    const T* own = parameters[3];
    if (!view->q) return moved(view->bMe, own);
    T added[kDhNumbers];
    std::copy(chain, chain + kDhNumbers, added);
    for (int i = 0; i < 4; ++i) added[4 * i + 3] += own[i];
    return end_effector(problem->arm, *view->q, added);
  }

  template <class T>
  bool of(const T* base, const T* gripper, const TransformOf<T>& bMe_of_view, T* out) const {
    const TransformOf<T> cMg = moved(cMb, base) * bMe_of_view * moved(eMg, gripper);
    Eigen::Matrix<T, Eigen::Dynamic, 1> error(size());
    for (std::size_t k = 0; k < view->points.size(); ++k) {
      const VectorOf<T> p = cMg * view->points[k].cast<T>();
      T* at = error.data() + per_point() * static_cast<int>(k);
      if (view->corners.empty()) {
        const Vector3d seen = view->cMg * view->points[k];
        for (int i = 0; i < 3; ++i) at[i] = p[i] - seen[i];
      } else {
        if (!project(*problem->camera, p, at)) return false;
        at[0] -= view->corners[k].x();
        at[1] -= view->corners[k].y();
      }
    }
    Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 1>> whitened(out, size());
    if (whiten)
      whitened = whiten->cast<T>() * error;
    else
      whitened = error;
    return true;
  }
};

/// What is looked for, and where it stands.
struct HandEyeState {
  Transform cMb = Transform::Identity(), eMg = Transform::Identity();
  std::array<double, kDhNumbers> chain{};  ///< added to the arm's
};

/// Index of numbers in HandEyeState::chain: those refined.
using ChainNumbers = std::vector<int>;

/// One view's error by everything it may depend on, at a state.
struct ViewErrors {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd by_state;  ///< columns: steps of cMb and eMg, the chain's refined numbers
  Eigen::MatrixXd by_view;   ///< columns: joints, or a step of bMe
};
/// Nothing if a point lies behind the camera.
std::optional<ViewErrors> view_errors(const HandEyeProblem& problem, const HandEyeView& view, const HandEyeState& state,
                                      const ChainNumbers& refined);

/// Root mean square length of a point's error; infinite if a point lies behind the camera.
double view_rms(const HandEyeProblem& problem, const HandEyeView& view, const HandEyeState& state);

/// Moves the state to the least squares of `views`. `whiten`: one for each of them, or none. `robust_scale`: of a Cauchy loss on a
/// view's root mean square; 0: none.
/// Errors: InputError without a minimum.
void minimise(const HandEyeProblem& problem, const std::vector<std::size_t>& views, const ChainNumbers& refined,
              const std::vector<Eigen::MatrixXd>& whiten, double robust_scale, HandEyeState& state);

}  // namespace tankrig
