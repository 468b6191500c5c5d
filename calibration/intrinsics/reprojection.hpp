// Where a target's points are expected in a picture, for Ceres: lens and places are what it looks for.
#pragma once

#include <ceres/rotation.h>

#include <array>
#include <vector>

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

/// Expected less seen, of one point, times `weight`.
struct Reprojection {
  Vector3d point;
  Vector2d shape, pixel;
  double weight = 1;

  template <class T>
  bool operator()(const T* camera, const T* kMc, const T* cMt, const T* bend, T* residual) const {
    T p[3];
    in_camera(kMc, cMt, bend, p);
    return seen(camera, p, residual);
  }

 protected:
  template <class T>
  void in_camera(const T* kMc, const T* cMt, const T* bend, T* p) const {
    const T on_target[3] = {T(point.x()), T(point.y()), T(point.z()) + bend[0] * shape.x() + bend[1] * shape.y()};
    T in_c[3];
    place(cMt, on_target, in_c);
    place(kMc, in_c, p);
  }

  template <class T>
  bool seen(const T* camera, const T* p, T* residual) const {
    if (!project(camera, p, residual)) return false;
    residual[0] = weight * (residual[0] - pixel.x());
    residual[1] = weight * (residual[1] - pixel.y());
    return true;
  }
};

}  // namespace tankrig
