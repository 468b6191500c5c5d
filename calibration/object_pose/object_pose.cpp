#include "calibration/object_pose/object_pose.hpp"

#include <ceres/autodiff_cost_function.h>
#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/estimate/differentiable.hpp"
#include "calibration/estimate/least_squares.hpp"
#include "calibration/object_pose/clicks.hpp"
#include "calibration/object_pose/visp_poses.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kRival = 2.5;  // times the error of the pose taken: one that fits alike
constexpr double kRival_rad = 0.05;
constexpr double kFarStart = 20, kFarStart_px = 50;  // beyond both a method's answer leads nowhere

struct CornerError {
  const CameraModel* camera;
  const ClickedCorner* corner;
  Transform cMo;

  template <class T>
  bool operator()(const T* step, T* out) const {
    const VectorOf<T> p = moved(cMo, step) * corner->o.cast<T>();
    if (!project(*camera, p, out)) return false;
    for (int k = 0; k < 2; ++k) out[k] = (out[k] - corner->pixel[k]) / corner->sigma;
    return true;
  }
};

double angle_between(const Transform& a, const Transform& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear() * b.linear().transpose())).angle();
}

/// The pose's least squares, and its residuals and their derivatives there.
Linearised refined(const ObjectPoseProblem& problem, Transform& cMo) {
  Linearised at;
  for (int round = 0; round < 2; ++round) {  // the second is about the first's answer: its step is small
    std::array<double, kPoseStep> step{};
    ceres::Problem least_squares;
    for (const ClickedCorner& corner : problem.corners)
      least_squares.AddResidualBlock(
          new ceres::AutoDiffCostFunction<CornerError, 2, kPoseStep>(new CornerError{&problem.camera, &corner, cMo}),
          nullptr, step.data());
    minimise(least_squares, "object pose");
    at = linearised(least_squares, {step.data()});
    cMo = moved(cMo, step.data());
  }
  return at;
}

}  // namespace

ObjectPoseSolution solve(const ObjectPoseProblem& problem) {
  check_clicks(problem);
  ObjectPoseSolution solution;
  std::vector<Vector3d> points;
  std::vector<Vector2d> pixels;
  for (const ClickedCorner& c : problem.corners) points.push_back(c.o), pixels.push_back(c.pixel);
  for (const VispPose& found : visp_poses(problem.camera, points, pixels)) {
    PoseMethod method{found.name, found.failure, found.pose};
    if (method.failure.empty()) {
      method.rms_px = clicks_rms(problem.camera, problem.corners, found.pose);
      if (!std::isfinite(method.rms_px)) method.failure = "puts the object behind the camera";
    }
    solution.methods.push_back(method);
  }
  // The paper keeps the method of the smallest error. From the others too: a flat object has two minima.
  std::vector<const PoseMethod*> order;
  for (const PoseMethod& m : solution.methods)
    if (m.failure.empty()) order.push_back(&m);
  std::stable_sort(order.begin(), order.end(),
                   [](const PoseMethod* a, const PoseMethod* b) { return a->rms_px < b->rms_px; });
  if (order.empty()) throw InputError("object pose: no method of ViSP found a pose: " + solution.methods[0].failure);
  Linearised at;
  solution.rms_px = std::numeric_limits<double>::infinity();
  std::vector<RivalPose> minima;
  for (const PoseMethod* start : order) {
    if (start->rms_px > std::max(kFarStart * order[0]->rms_px, kFarStart_px)) continue;
    Transform cMo = start->cMo;
    Linearised here;
    try {
      here = refined(problem, cMo);
    } catch (const InputError&) {
      continue;  // another start may have a minimum
    }
    const double rms = clicks_rms(problem.camera, problem.corners, cMo);
    minima.push_back({cMo, rms, 0});
    if (rms < solution.rms_px * (1 - 1e-9)) {
      solution.rms_px = rms;
      solution.cMo = cMo;
      solution.start = start->name;
      at = here;
    }
  }
  refuse_wrong_clicks(problem, solution.cMo, solution.rms_px);
  for (RivalPose& other : minima) {
    other.rotation = angle_between(other.cMo, solution.cMo);
    if (other.rotation > kRival_rad && other.rms_px < std::max(kRival * solution.rms_px, 1.0) &&
        (!solution.rival || other.rms_px < solution.rival->rms_px))
      solution.rival = other;
  }
  for (PoseMethod& m : solution.methods) {
    m.rotation = angle_between(m.cMo, solution.cMo);
    m.translation = (m.cMo.translation() - solution.cMo.translation()).norm();
  }
  const auto coordinates = static_cast<double>(at.residuals.size());
  solution.degrees_of_freedom = coordinates - kPoseStep;
  solution.sigma_px = std::sqrt(at.residuals.squaredNorm() / solution.degrees_of_freedom);
  std::vector<std::string> names;
  for (int k = 0; k < kPoseStep; ++k)
    names.push_back(fmt::format("{} {}", k < 3 ? "rotation" : "translation", "xyz"[k % 3]));
  solution.covariance = solution.sigma_px * solution.sigma_px * covariance_of(at.jacobian, names, "object pose");
  const double factor = interval_factor(solution.degrees_of_freedom);
  const auto whole = step_between(Transform::Identity(), solution.cMo);
  for (int k = 0; k < kPoseStep; ++k) {
    const double sigma = std::sqrt(solution.covariance(k, k));
    Eigen::Matrix<double, 6, 6> alone = Eigen::Matrix<double, 6, 6>::Zero();
    alone(k, k) = sigma * sigma;
    Estimate e{names[static_cast<std::size_t>(k)], k < 3 ? "rad" : "m", whole[k], sigma, factor * sigma, 0};
    e.effect = problem.shape.surface_error(in_object(solution.cMo, alone)).rms;
    solution.parameters.push_back(e);
  }
  solution.surface = problem.shape.surface_error(in_object(solution.cMo, solution.covariance));
  for (const ClickedCorner& c : problem.corners)
    solution.residuals_px.push_back(*problem.camera.project(solution.cMo * c.o) - c.pixel);
  return solution;
}

}  // namespace tankrig
