// What a plan's light must keep to, known before anything moves.
#pragma once

#include <optional>

#include "rig/plan/scan_plan.hpp"
#include "rig/plan/scan_settings.hpp"
#include "rig/safety/safety_settings.hpp"

namespace tankrig {

/// When the plan first asks for light [s]; nothing if it never does.
std::optional<double> first_light(const ScanPlan& plan);

/// Every stretch of light within maximum_on, every hold within hold_limit and without motion; dark pauses shorter than
/// indicator_delay belong to their stretch.
/// Errors: InputError, one line that names the key.
void check_light(const ScanPlan& plan, const SafetySettings& settings);

/// Whether a camera is a witness of the beam, by the rig file's word.
bool testifies(const BeamSettings& settings, const std::string& camera);

/// A camera that is to see the stripe must have seen the dark before: else it would testify to nothing, unnoticed.
/// Errors: InputError, one line that names the camera and the cure, unless the settings waive it.
void check_witness(const ScanPlan& plan, const BeamSettings& settings, const std::string& camera, RecordWhen record);

}  // namespace tankrig
