// From a recorded session to its report.
#pragma once

#include <optional>
#include <vector>

#include "apps/tankrig/methods.hpp"
#include "apps/tankrig/progress.hpp"
#include "apps/tankrig/scores.hpp"
#include "session/reading/session.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// Clouds, scores, pictures, report.html and SHA256SUMS, with progress. `world` as for write_pictures_and_report.
/// Nothing if a signal stopped it on the way: then there is no report, and the check sums are of what there is.
std::optional<std::vector<Score>> reconstruct_and_report(const Session& session,
                                                         const ReconstructionParameters& parameters,
                                                         const sim::TankWorld* world, Progress& progress);

}  // namespace tankrig::app
