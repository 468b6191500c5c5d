// How well a calibrated camera knows where a point appears: all over the image, at a working distance.
#pragma once

#include <Eigen/Core>

#include "calibration/intrinsics/intrinsics.hpp"

namespace tankrig {

/// A point at rest with the targets, seen by the camera: its pixel moves with the camera's parameters and, because the
/// camera's own place is only known by the targets, with theirs. As mrcal 2 has it: the mean over the views.
/// Units: pixels, metres, one standard deviation in the worst direction.
class ProjectionUncertainty {
 public:
  explicit ProjectionUncertainty(const IntrinsicsSolution& solution) : solution_(solution) {}

  struct At {
    double px = 0;              ///< with the allowance for neighbours that err alike
    double independent_px = 0;  ///< as if every corner erred by itself
    double metres = 0;          ///< `px` across the ray, at that distance
  };
  /// At a pixel, for points `distance` from the camera along its ray. Nothing where the pixel has no ray.
  std::optional<At> at(const Vector2d& pixel, double distance) const;

 private:
  const IntrinsicsSolution& solution_;
};

}  // namespace tankrig
