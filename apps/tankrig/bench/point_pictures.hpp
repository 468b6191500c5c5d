// Small pictures of what was seen in a configuration and made of it, for the page.
#pragma once

#include <string>
#include <vector>

#include "bench/sweep/point_views.hpp"
#include "pipeline/score_session.hpp"

namespace tankrig::app {

/// The laser's camera with the laser on, in the middle of the sweep, and with it off, and the stereo pair with it off: those
/// of them whose pictures the session has.
std::vector<PointView> frame_views(const Session& session);

/// The cloud over the object, from where the camera is.
PointView cloud_view(const Session& session, const Score& score, const std::string& measure,
                     const CalibratedCamera& camera, const TriangleMesh& object);

}  // namespace tankrig::app
