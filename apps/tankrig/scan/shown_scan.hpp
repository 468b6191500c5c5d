// A rig in motion as whoever listens to the feed sees it: what stands where, the arm's links, the laser.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "pipeline/score_session.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/executive/safe_end.hpp"
#include "rig/scan/scan.hpp"

namespace tankrig::app {

/// The object's mesh and the cameras, in b. A mesh that cannot be read is left out; whoever scores by it says so.
nlohmann::ordered_json scene_json(const RigConfig& rig);
/// The same, once.
void show_scene(const RigConfig& rig);
/// The arm, the laser, the cameras' losses, the cycle's wake-ups and the plan's time.
void show_state(const RigConfig& rig, const ScanProgress& progress);
/// The ambient light, as the lux meter or somebody said.
void show_lux(double lux, const std::string& source);
/// What was confirmed at the end.
void show_end(const EndState& left);
/// How good its clouds are.
void show_scores(const std::vector<Score>& scores);

}  // namespace tankrig::app
