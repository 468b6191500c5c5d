// From stripe points in an image to points in space.
#pragma once

#include <vector>

#include "core/camera_model.hpp"
#include "reconstruction/cloud/cloud.hpp"
#include "reconstruction/stripe/stripe.hpp"

namespace tankrig {

struct TriangulationParameters {
  double plane_angle_sigma =
      0;                    ///< uncertainty of the laser plane's direction [rad], about its point nearest the camera
  double min_angle = 0.02;  ///< smallest angle between viewing ray and laser plane [rad]
};

/// Meets the ray of every peak with the laser plane and appends the points to `points`.
/// Frames: camera frame c, metres; `cPl` is the laser plane in c. `sigma` is along the viewing ray, from sigma_px and
/// plane_angle_sigma; 0 if both are 0. Counts points, behind_camera and grazing in `statistics`.
void triangulate(const StripeDetection& detection, const CameraModel& camera, const Plane& cPl, int frame,
                 const TriangulationParameters& parameters, std::vector<CloudPoint>& points,
                 StripeStatistics& statistics);

}  // namespace tankrig
