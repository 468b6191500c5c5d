#include "calibration/intrinsics/board_bundle.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calibration/estimate/least_squares.hpp"
#include "calibration/intrinsics/reprojection.hpp"

namespace tankrig {
namespace {

constexpr double kRationalPrior = 0.1;  // px of residual for k4, k5, k6 of one: without it they run away together

/// Of a camera's k4, k5, k6.
ceres::CostFunction* rational_prior() {
  ceres::Matrix weights = ceres::Matrix::Zero(3, kCameraParameters);
  weights.rightCols<3>().diagonal().setConstant(kRationalPrior);
  return new ceres::NormalPrior(weights, ceres::Vector::Zero(kCameraParameters));
}

/// The bundle as Ceres has it.
class LeastSquares {
 public:
  LeastSquares(const BoardBundle& bundle, double cauchy_px) : bundle_(bundle) {
    for (const RationalCamera& camera : bundle.cameras) {
      cameras_.push_back(parameters_of(camera));
      ports_.push_back(parameters_of(camera.port.value_or(FlatPort{})));
    }
    for (const Transform& aMb : bundle.kMc) relative_.push_back(numbers_of(aMb));
    for (const Transform& aMb : bundle.cMt) views_.push_back(numbers_of(aMb));
    bend_ = {bundle.bend.x(), bundle.bend.y()};
    const std::vector<Vector3d> points = bundle.target.points();
    const std::vector<Vector2d> shapes = bend_shapes(bundle.target);
    for (std::size_t v = 0; v < views_.size(); ++v)
      for (std::size_t k = 0; k < cameras_.size(); ++k) {
        const FoundBoard& board = bundle.views[v].seen[k];
        for (std::size_t i = 0; i < board.ids.size(); ++i) {
          const auto id = static_cast<std::size_t>(board.ids[i]);
          ceres::LossFunction* loss = cauchy_px > 0 ? new ceres::CauchyLoss(cauchy_px) : nullptr;
          problem_.AddResidualBlock(new BoardCorner(points[id], shapes[id], board.pixels[i], bundle.cameras[k].port),
                                    loss, cameras_[k].data(), ports_[k].data(), relative_[k].data(), views_[v].data(),
                                    bend_.data());
          corners_.push_back({static_cast<int>(k), v, board.ids[i], board.pixels[i]});
        }
      }
    if (bundle.lens == LensModel::kRational)
      for (CameraParameters& camera : cameras_) problem_.AddResidualBlock(rational_prior(), nullptr, camera.data());
    hold_what_is_not_free();
  }

  BundleFit solve(BoardBundle& out) {
    ceres::Solver::Summary summary;
    ceres::Solve(solver_options(ceres::DENSE_SCHUR), &problem_, &summary);
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      out.cameras[k] = camera_of(out.cameras[k], cameras_[k]);
      if (auto& port = out.cameras[k].port) port = port_of(*port, ports_[k]);
      out.kMc[k] = transform_of(relative_[k]);
    }
    for (std::size_t v = 0; v < views_.size(); ++v) out.cMt[v] = transform_of(views_[v]);
    out.bend = {bend_[0], bend_[1]};
    BundleFit fit{std::move(corners_), summary.IsSolutionUsable()};
    std::vector<double> errors;
    ceres::Problem::EvaluateOptions all;
    all.apply_loss_function = false;
    problem_.Evaluate(all, nullptr, &errors, nullptr, nullptr);
    for (std::size_t i = 0; i < fit.residuals.size(); ++i) fit.residuals[i].error = {errors[2 * i], errors[2 * i + 1]};
    return fit;
  }

  BundleCovariance covariance() {
    BundleCovariance result;
    BundleLayout& layout = result.layout;
    std::vector<std::string> names;
    ceres::Problem::EvaluateOptions options;
    const std::vector<int> free = free_parameters(bundle_.lens);
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      layout.cameras.emplace_back().fill(-1);
      if (bundle_.lens_held) continue;
      options.parameter_blocks.push_back(cameras_[k].data());
      for (const int i : free) {
        layout.cameras.back()[static_cast<std::size_t>(i)] = layout.size++;
        names.push_back(std::string(kCameraParameterNames[static_cast<std::size_t>(i)]));
      }
    }
    layout.ports.assign(cameras_.size(), -1);
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      if (!bundle_.cameras[k].port) continue;
      options.parameter_blocks.push_back(ports_[k].data());
      layout.ports[k] = layout.size;
      layout.size += kPortParameters;
      names.insert(names.end(), kPortParameterNames.begin(), kPortParameterNames.end());
    }
    layout.relative.assign(cameras_.size(), -1);
    const auto add_pose = [&](double* block, const std::string& name) {
      options.parameter_blocks.push_back(block);
      for (int i = 0; i < 6; ++i) names.push_back(name);
      layout.size += 6;
      return layout.size - 6;
    };
    for (std::size_t k = 1; k < cameras_.size(); ++k)
      layout.relative[k] = add_pose(relative_[k].data(), "the cameras' places");
    if (bundle_.bends) {
      options.parameter_blocks.push_back(bend_.data());
      layout.bend = layout.size;
      layout.size += 2;
      names.insert(names.end(), 2, "the target's bend");
    }
    for (std::size_t v = 0; v < views_.size(); ++v)
      layout.views.push_back(add_pose(views_[v].data(), "the target's place in " + bundle_.views[v].name));
    invert(normal_matrix(options, layout.size), names, result);
    return result;
  }

 private:
  void hold_what_is_not_free() {
    const std::vector<int> free = free_parameters(bundle_.lens);
    std::vector<int> held;
    for (int i = 0; i < kCameraParameters; ++i)
      if (std::find(free.begin(), free.end(), i) == free.end()) held.push_back(i);
    for (CameraParameters& camera : cameras_)
      if (bundle_.lens_held)
        problem_.SetParameterBlockConstant(camera.data());
      else if (!held.empty())
        problem_.SetManifold(camera.data(), new ceres::SubsetManifold(kCameraParameters, held));
    for (std::size_t k = 0; k < cameras_.size(); ++k)
      if (!bundle_.cameras[k].port) problem_.SetParameterBlockConstant(ports_[k].data());
    problem_.SetParameterBlockConstant(relative_.front().data());
    if (!bundle_.bends) problem_.SetParameterBlockConstant(bend_.data());
  }

  Eigen::MatrixXd normal_matrix(const ceres::Problem::EvaluateOptions& options, int size) {
    ceres::CRSMatrix jacobian;
    problem_.Evaluate(options, nullptr, nullptr, nullptr, &jacobian);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    for (std::size_t row = 0; row + 1 < jacobian.rows.size(); ++row)
      for (int i = jacobian.rows[row]; i < jacobian.rows[row + 1]; ++i)
        for (int j = jacobian.rows[row]; j < jacobian.rows[row + 1]; ++j) {
          const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
          normal(jacobian.cols[a], jacobian.cols[b]) += jacobian.values[a] * jacobian.values[b];
        }
    return normal;
  }

  static void invert(const Eigen::MatrixXd& normal, const std::vector<std::string>& names, BundleCovariance& result) {
    constexpr double kSmallestShare = 1e-13;
    const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * normal * scale.asDiagonal());
    const Eigen::VectorXd& values = eigen.eigenvalues();
    const Eigen::MatrixXd& vectors = eigen.eigenvectors();
    for (Eigen::Index i = 0; i < values.size() && values[i] < kSmallestShare * values[values.size() - 1]; ++i) {
      Eigen::Index worst = 0;
      vectors.col(i).cwiseAbs().maxCoeff(&worst);
      result.unobservable.push_back(names[static_cast<std::size_t>(worst)]);
    }
    if (!result.unobservable.empty()) return;
    result.matrix =
        scale.asDiagonal() * vectors * values.cwiseInverse().asDiagonal() * vectors.transpose() * scale.asDiagonal();
  }

  const BoardBundle& bundle_;
  std::vector<CameraParameters> cameras_;
  std::vector<PortParameters> ports_;
  std::vector<PoseNumbers> relative_, views_;
  std::array<double, 2> bend_{};
  std::vector<CornerResidual> corners_;
  ceres::Problem problem_;
};

}  // namespace

PoseNumbers numbers_of(const Transform& aMb) {
  const Eigen::AngleAxisd turn(aMb.rotation());
  const Vector3d r = turn.angle() * turn.axis(), t = aMb.translation();
  return {r.x(), r.y(), r.z(), t.x(), t.y(), t.z()};
}

Transform transform_of(const PoseNumbers& numbers) {
  Transform aMb = Transform::Identity();
  const Vector3d r(numbers[0], numbers[1], numbers[2]);
  if (r.norm() > 0) aMb.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  aMb.translation() = Vector3d(numbers[3], numbers[4], numbers[5]);
  return aMb;
}

std::vector<Vector2d> bend_shapes(const BoardTarget& target) {
  const std::vector<Vector3d> flat = target.points();
  const Vector3d middle = flat.back() / 2, half = middle.cwiseMax(1e-9);
  std::vector<Vector2d> shapes;
  for (const Vector3d& p : flat) {
    const double x = (p.x() - middle.x()) / half.x(), y = (p.y() - middle.y()) / half.y();
    shapes.emplace_back(1 - x * x, 1 - y * y);
  }
  return shapes;
}

CameraParameters parameters_of(const RationalCamera& c) {
  return {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6};
}

RationalCamera camera_of(const CameraModel& like, const CameraParameters& p) {
  return {
      {like.width, like.height, p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], like.port}, p[9], p[10], p[11]};
}

PortParameters parameters_of(const FlatPort& port) {
  return {port.distance, port.normal.x() / port.normal.z(), port.normal.y() / port.normal.z()};
}

FlatPort port_of(const FlatPort& like, const PortParameters& p) {
  FlatPort port = like;
  port.distance = p[0];
  port.normal = Vector3d(p[1], p[2], 1).normalized();
  return port;
}

std::vector<int> free_parameters(LensModel lens) {
  switch (lens) {
    case LensModel::kK1:
      return {0, 1, 2, 3, 4};
    case LensModel::kK1K2:
      return {0, 1, 2, 3, 4, 5};
    case LensModel::kK1K2P1P2:
      return {0, 1, 2, 3, 4, 5, 6, 7};
    case LensModel::kPlumbBob:
      return {0, 1, 2, 3, 4, 5, 6, 7, 8};
    case LensModel::kRational:
      break;
  }
  return {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
}

std::vector<Vector3d> BoardBundle::points() const {
  std::vector<Vector3d> bent = target.points();
  const std::vector<Vector2d> shapes = bend_shapes(target);
  for (std::size_t i = 0; i < bent.size(); ++i) bent[i].z() += bend.dot(shapes[i]);
  return bent;
}

BundleFit solve(BoardBundle& bundle, double cauchy_px) {
  BoardBundle solved = bundle;
  BundleFit fit = LeastSquares(bundle, cauchy_px).solve(solved);
  bundle = std::move(solved);
  return fit;
}

BundleCovariance covariance(const BoardBundle& bundle) { return LeastSquares(bundle, 0).covariance(); }

double rms(const std::vector<CornerResidual>& residuals) {
  double sum = 0;
  for (const CornerResidual& r : residuals) sum += r.error.squaredNorm();
  return residuals.empty() ? 0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

}  // namespace tankrig
