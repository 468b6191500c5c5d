// The residuals of the joint problem, for Ceres: marker and stripe as the whole rig expects them, less where they were seen.
#pragma once

#include "calibration/estimate/differentiable.hpp"
#include "calibration/intrinsics/reprojection.hpp"
#include "calibration/joint/joint.hpp"

namespace tankrig {

template <class T>
TransformOf<T> pose_of(const T* numbers) {
  Eigen::Matrix<T, 3, 3> turn;
  ceres::AngleAxisToRotationMatrix(numbers, turn.data());
  TransformOf<T> out = TransformOf<T>::Identity();
  out.linear() = turn;
  out.translation() = VectorOf<T>(numbers[3], numbers[4], numbers[5]);
  return out;
}

/// aMb after a small step of b's frame in a: a rotation about the axes of a, b's origin moved.
template <class T>
TransformOf<T> stepped(const TransformOf<T>& aMb, const T* step) {
  Eigen::Matrix<T, 3, 3> turn;
  ceres::AngleAxisToRotationMatrix(step, turn.data());
  TransformOf<T> out = aMb;
  out.linear() = turn * aMb.linear();
  out.translation() += VectorOf<T>(step[3], step[4], step[5]);
  return out;
}

/// bMe where the joints stand by `more` beyond `q`.
template <class T>
TransformOf<T> arm_at(const ArmModel& arm, const JointVector& q, const T* more) {
  T added[kDhNumbers];
  for (int i = 0; i < kDhNumbers; ++i) added[i] = i % 4 == 3 ? more[i / 4] : T(0);
  return end_effector(arm, q, added);
}

/// By how much joints stand beyond what they read at a picture's stamp, in a sweep. `sweep`: slew and shoulder, the same all along;
/// `delay`: of the stamp [s].
template <class T>
std::array<T, 4> beyond_reading(const T* zeros, const T* sweep, const T& delay, const JointVector& velocity) {
  std::array<T, 4> more;
  for (int i = 0; i < 4; ++i) more[static_cast<std::size_t>(i)] = zeros[i] - velocity[i] * delay;
  more[0] += sweep[0], more[1] += sweep[1];
  return more;
}

/// All points of the marker in one camera's picture.
struct MarkerInPicture {
  const ArmModel* arm = nullptr;
  const MarkerPosture* posture = nullptr;
  std::size_t camera = 0;
  std::optional<FlatPort> like;
  double weight = 1;

  /// `joints`: where they stand beyond what they read; `knock`: how kMc differs from that of the boards.
  template <class T>
  bool operator()(const T* lens, const T* port, const T* kMc, const T* cMb, const T* eMg, const T* zeros,
                  const T* joints, const T* knock, T* out) const {
    T more[4];
    for (int i = 0; i < 4; ++i) more[i] = zeros[i] + joints[i];
    const TransformOf<T> kMg =
        stepped(pose_of(kMc), knock) * pose_of(cMb) * arm_at(*arm, posture->q, more) * pose_of(eMg);
    const SeenMarker& seen = posture->seen[camera];
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      const VectorOf<T> p = kMg * seen.points[i].cast<T>();
      T* at = out + 2 * i;
      if (!project(lens, like, port, p, at)) return false;
      for (int k = 0; k < 2; ++k) at[k] = weight * (at[k] - seen.corners[i][k]);
    }
    return true;
  }
};

/// The laser's plane for Ceres: tilts of its normal towards u and v, and its distance at a point on it.
struct PlaneFrame {
  Vector3d centre, u, v, normal;

  template <class T>
  VectorOf<T> normal_of(const T* numbers) const {
    return (normal.cast<T>() + numbers[0] * u.cast<T>() + numbers[1] * v.cast<T>()).normalized();
  }
};

/// Where the laser's sheet crosses a board beside a place on the stripe: how far off in the picture, across the stripe. For both
/// places of the stripe; out: their sum and difference over the square root of two.
/// Where the stripe is expected: the place is moved within the board, across the stripe, until it lies in the plane.
struct StripeInPicture {
  const ArmModel* arm = nullptr;
  const BoardStripe* stripe = nullptr;
  const PlaneFrame* frame = nullptr;
  std::optional<FlatPort> like;
  std::array<Vector2d, 2> on_board;  ///< about where it was seen, in t
  Vector2d across_t, across_px;      ///< unit, across the stripe, on the board and in the picture
  double offset_weight = 1, slope_weight = 1;

  /// `sweep`, `delay`: of beyond_reading(); `knock`: how cMb differs from that of the marker.
  template <class T>
  bool operator()(const T* lens, const T* port, const T* cMt, const T* cMb, const T* zeros, const T* plane,
                  const T* sweep, const T* delay, const T* knock, T* out) const {
    const std::array<T, 4> more = beyond_reading(zeros, sweep, *delay, stripe->velocity);
    const TransformOf<T> cMe = stepped(pose_of(cMb), knock) * arm_at(*arm, stripe->q, more.data());
    const TransformOf<T> board = pose_of(cMt);
    const VectorOf<T> normal = cMe.linear() * frame->normal_of(plane);
    const VectorOf<T> on_plane = cMe * frame->centre.cast<T>();
    const VectorOf<T> across = board.linear() * Vector3d(across_t.x(), across_t.y(), 0).cast<T>();
    const T slope = normal.dot(across);
    T off[2];
    for (int side = 0; side < 2; ++side) {
      const VectorOf<T> at = board * Vector3d(on_board[side].x(), on_board[side].y(), 0).cast<T>();
      const VectorOf<T> there = at - (normal.dot(at - on_plane) + plane[2]) / slope * across;
      T pixel[2];
      if (!project(lens, like, port, there, pixel)) return false;
      off[side] =
          across_px.x() * (pixel[0] - stripe->pixels[side].x()) + across_px.y() * (pixel[1] - stripe->pixels[side].y());
    }
    out[0] = offset_weight * M_SQRT1_2 * (off[0] + off[1]);
    out[1] = slope_weight * M_SQRT1_2 * (off[0] - off[1]);
    return true;
  }
};

}  // namespace tankrig
