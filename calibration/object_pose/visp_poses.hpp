// The pose of points by every method that ViSP has.
#pragma once

#include <vector>

#include "calibration/visp/visp_methods.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

/// In a fixed order. `points` in o, `pixels` where they are seen. LOWE and VIRTUAL_VS alone start from a rough pose in front of the
/// camera, turned by a milliradian: from exactly none LOWE stays where it is.
std::vector<VispPose> visp_poses(const CameraModel& camera, const std::vector<Vector3d>& points,
                                 const std::vector<Vector2d>& pixels);

}  // namespace tankrig
