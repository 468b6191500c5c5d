#include "calibration/intrinsics/reprojection.hpp"

#include <ceres/jet.h>

#include <type_traits>

namespace tankrig {
namespace {

template <int rows, int columns>
using Derivative = Eigen::Matrix<double, rows, columns, Eigen::RowMajor>;

struct Placed {
  Vector3d p;
  Derivative<3, 6> by_pose;
  Derivative<3, 3> by_point;
};

Placed placed(const double* aMb, const Vector3d& p) {
  using Number = ceres::Jet<double, 6>;  // rotation and point
  Number turn[3], at[3], turned[3];
  for (int i = 0; i < 3; ++i) turn[i] = Number(aMb[i], i), at[i] = Number(p[i], 3 + i);
  ceres::AngleAxisRotatePoint(turn, at, turned);
  Placed out;
  for (int i = 0; i < 3; ++i) {
    out.p[i] = turned[i].a + aMb[3 + i];
    out.by_pose.row(i) << turned[i].v.head<3>().transpose(), Vector3d::Unit(i).transpose();
    out.by_point.row(i) = turned[i].v.tail<3>();
  }
  return out;
}

struct Seen {
  Vector3d p;
  Derivative<3, kPortParameters> by_port = Derivative<3, kPortParameters>::Zero();
  Derivative<3, 3> by_point = Derivative<3, 3>::Identity();
};

/// Where the camera seems to see p through its port.
std::optional<Seen> seen(const std::optional<FlatPort>& like, const double* port, const Vector3d& p) {
  using Number = ceres::Jet<double, kPortParameters + 3>;
  Seen out{p};
  if (!like) return out;
  Number numbers[kPortParameters];
  for (int i = 0; i < kPortParameters; ++i) numbers[i] = Number(port[i], i);
  VectorOf<Number> at, there;
  for (int i = 0; i < 3; ++i) at[i] = Number(p[i], kPortParameters + i);
  const VectorOf<Number> normal = VectorOf<Number>(numbers[1], numbers[2], Number(1)).normalized();
  if (!seen_through<Number>(*like, numbers[0], normal, at, there)) return std::nullopt;
  for (int i = 0; i < 3; ++i) {
    out.p[i] = there[i].a;
    out.by_port.row(i) = there[i].v.head<kPortParameters>();
    out.by_point.row(i) = there[i].v.tail<3>();
  }
  return out;
}

struct Projected {
  Vector2d pixel;
  Derivative<2, kCameraParameters> by_camera;
  Derivative<2, 3> by_point;
};

std::optional<Projected> projected(const double* camera, const Vector3d& p) {
  using Number = ceres::Jet<double, kCameraParameters + 3>;
  Number numbers[kCameraParameters], at[3], pixel[2];
  for (int i = 0; i < kCameraParameters; ++i) numbers[i] = Number(camera[i], i);
  for (int i = 0; i < 3; ++i) at[i] = Number(p[i], kCameraParameters + i);
  if (!project(numbers, at, pixel)) return std::nullopt;
  Projected out;
  for (int i = 0; i < 2; ++i) {
    out.pixel[i] = pixel[i].a;
    out.by_camera.row(i) = pixel[i].v.head<kCameraParameters>();
    out.by_point.row(i) = pixel[i].v.tail<3>();
  }
  return out;
}

}  // namespace

bool BoardCorner::Evaluate(const double* const* blocks, double* error, double** jacobians) const {
  const double *camera = blocks[0], *port = blocks[1], *kMc = blocks[2], *cMt = blocks[3], *bend = blocks[4];
  const Vector3d on_target = point_ + Vector3d(0, 0, bend[0] * shape_.x() + bend[1] * shape_.y());
  const auto set_error = [&](const Vector2d& expected) { Eigen::Map<Vector2d>{error} = weight_ * (expected - pixel_); };
  if (!jacobians) {
    Vector3d in_c, in_k;
    Vector2d expected;
    place(cMt, on_target.data(), in_c.data());
    place(kMc, in_c.data(), in_k.data());
    if (!project(camera, like_, port, in_k, expected.data())) return false;
    set_error(expected);
    return true;
  }
  const Placed in_c = placed(cMt, on_target), in_k = placed(kMc, in_c.p);
  const std::optional<Seen> in_air = seen(like_, port, in_k.p);
  if (!in_air) return false;
  const std::optional<Projected> expected = projected(camera, in_air->p);
  if (!expected) return false;
  set_error(expected->pixel);
  const Derivative<2, 3> by_air = weight_ * expected->by_point, by_k = by_air * in_air->by_point,
                         by_c = by_k * in_k.by_point;
  const auto set = [&](int block, const auto& derivative) {
    using Rows = Derivative<2, std::decay_t<decltype(derivative)>::ColsAtCompileTime>;
    if (jacobians[block]) Eigen::Map<Rows>{jacobians[block]} = derivative;
  };
  set(0, weight_ * expected->by_camera);
  set(1, by_air * in_air->by_port);
  set(2, by_k * in_k.by_pose);
  set(3, by_c * in_c.by_pose);
  set(4, by_c * in_c.by_point.col(2) * shape_.transpose());
  return true;
}

}  // namespace tankrig
