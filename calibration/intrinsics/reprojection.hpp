// Where a target's points are expected in a picture, for Ceres: lens and places are what it looks for.
#pragma once

#include <ceres/rotation.h>
#include <ceres/sized_cost_function.h>

#include <array>
#include <optional>
#include <vector>

#include "calibration/estimate/differentiable.hpp"
#include "calibration/intrinsics/board_bundle.hpp"

namespace tankrig {

/// Of aMb: rotation vector, translation.
using PoseNumbers = std::array<double, 6>;
PoseNumbers numbers_of(const Transform& aMb);
Transform transform_of(const PoseNumbers& numbers);

/// How much of each bend a point of the target has: none at the edges, all in the middle.
std::vector<Vector2d> bend_shapes(const BoardTarget& target);

/// aMb * p.
template <class T>
void place(const T* aMb, const T* p, T* out) {
  ceres::AngleAxisRotatePoint(aMb, p, out);
  for (int i = 0; i < 3; ++i) out[i] += aMb[3 + i];
}

/// Units: px. `camera`: CameraParameters. False where the point is not in front of the camera.
template <class T>
bool project(const T* camera, const T* p, T* pixel) {
  constexpr double kNearest = 1e-6;  // m in front of the camera
  if (!(p[2] > kNearest)) return false;
  const T x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
  const T radial = (1.0 + r2 * (camera[4] + r2 * (camera[5] + r2 * camera[8]))) /
                   (1.0 + r2 * (camera[9] + r2 * (camera[10] + r2 * camera[11])));
  const T &p1 = camera[6], &p2 = camera[7];
  pixel[0] = camera[0] * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + camera[2];
  pixel[1] = camera[1] * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + camera[3];
  return true;
}

/// Likewise of a camera behind a port like `like`, with PortParameters `port`, if there is one. False too where light from p does
/// not come through it.
template <class T>
bool project(const T* camera, const std::optional<FlatPort>& like, const T* port, const VectorOf<T>& p, T* pixel) {
  VectorOf<T> seen = p;
  const VectorOf<T> normal(port[1], port[2], T(1));
  if (like && !seen_through<T>(*like, port[0], normal.normalized(), p, seen)) return false;
  return project(camera, seen.data(), pixel);
}

/// A corner of a target in the picture of camera k: expected less seen, times `weight` [px].
/// Blocks: the camera's CameraParameters and PortParameters (held where there is no port), kMc, cMt, the target's bend.
/// Derivatives by the chain of its steps: all numbers at once in one step would cost three times as much.
class BoardCorner final : public ceres::SizedCostFunction<2, kCameraParameters, kPortParameters, 6, 6, 2> {
 public:
  /// `point`: of the flat target, t; `shape`: of its bends there; `like`: the camera's port.
  BoardCorner(const Vector3d& point, const Vector2d& shape, const Vector2d& pixel, const std::optional<FlatPort>& like,
              double weight = 1)
      : point_(point), shape_(shape), pixel_(pixel), like_(like), weight_(weight) {}

  bool Evaluate(const double* const* blocks, double* error, double** jacobians) const override;

 private:
  Vector3d point_;
  Vector2d shape_, pixel_;
  std::optional<FlatPort> like_;
  double weight_;
};

}  // namespace tankrig
