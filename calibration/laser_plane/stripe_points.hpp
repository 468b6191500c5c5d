// Places in space of stripe points: on a board of known pose, or by a stereo pair.
#pragma once

#include <optional>
#include <vector>

#include "core/camera_model.hpp"
#include "core/frames.hpp"

namespace tankrig {

/// A point of the stripe as a detector finds it.
/// Units: pixels.
struct StripeLinePoint {
  int line = 0;         ///< the image column it was searched in; the row, for a stripe across the rows
  double position = 0;  ///< along that line
  double sigma = 0.1;   ///< of `position`
};

/// One stripe in one picture.
struct StripeLine {
  bool rows = false;                    ///< points are searched along image rows, not columns
  std::vector<StripeLinePoint> points;  ///< in order of `line`

  Vector2d pixel(const StripeLinePoint& point) const {
    return rows ? Vector2d(point.position, point.line) : Vector2d(point.line, point.position);
  }
};

/// Frames: c.
struct PlacedStripePoint {
  Vector3d p = Vector3d::Zero();
  double sigma = 0;  ///< how far one standard deviation of the picture moves it [m]
};

/// The part of a board that a stripe is used on.
/// Frames: the board's own, t, with the board in z = 0.
struct BoardArea {
  Vector2d min = Vector2d::Zero(), max = Vector2d::Zero();
};

/// Where the rays of the stripe meet the board, of those within `area`.
std::vector<PlacedStripePoint> points_on_board(const CameraModel& camera, const StripeLine& stripe,
                                               const Transform& cMt, const BoardArea& area);

struct StereoStripeParameters {
  double nearest = 0.3, farthest = 3;  ///< range of the points [m]
  double most_sigma = 0.01;  ///< in range; worse points are left out: the stripe lies along the epipolar line [m]
  int most_gap = 3;          ///< lines without a point that a stripe is interpolated across
};

/// Points of one stripe seen by both eyes, in the left one. A left point is used if its epipolar line crosses the right
/// stripe once. `cMr`: the right eye in the left one.
std::vector<PlacedStripePoint> points_by_stereo(const CameraModel& left, const CameraModel& right, const Transform& cMr,
                                                const StripeLine& left_stripe, const StripeLine& right_stripe,
                                                const StereoStripeParameters& parameters = {});

}  // namespace tankrig
