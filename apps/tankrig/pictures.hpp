// The pictures of a session and its report: what people look at first.
#pragma once

#include <vector>

#include "apps/tankrig/scores.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// Writes pictures/*.png and report.html into the session. `world`: the simulated tank for the outside view of the rig;
/// null keeps a picture of it that is already there.
void write_pictures_and_report(const Session& session, const ObjectSurface& object, const std::vector<Score>& scores,
                               const sim::TankWorld* world);

}  // namespace tankrig::app
