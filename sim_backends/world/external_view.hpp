// The whole rig seen from above one corner, for people.
#pragma once

#include <opencv2/core.hpp>

#include "sim_backends/world/arm_body.hpp"

namespace tankrig::sim {

/// BGR picture: tank without its near walls, arm at `q`, objects, cameras as frusta, the laser's fan and its line.
/// Its light is made up; nothing is measured in it.
cv::Mat external_view(const Scene& scene, const RenderGeometry& geometry, const JointVector& q, bool laser_on,
                      int width, int height);

}  // namespace tankrig::sim
