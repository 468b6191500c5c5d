// Checks of a plan's light before anything moves.
#pragma once

#include <optional>

#include "drivers/camera/camera.hpp"
#include "rig/plan/scan_plan.hpp"
#include "rig/plan/scan_settings.hpp"
#include "rig/safety/safety_settings.hpp"

namespace tankrig {

/// When the plan first asks for light [s]; nothing if it never does.
std::optional<double> first_light(const ScanPlan& plan);

/// Checks that every stretch of light is within maximum_on, and every hold within hold_limit and without motion. Dark
/// pauses shorter than indicator_delay belong to their stretch.
/// Errors: InputError, one line that names the key.
void check_light(const ScanPlan& plan, const SafetySettings& settings);

/// Whether the rig file makes a camera a witness of the beam.
bool testifies(const BeamSettings& settings, const std::string& camera);

/// A camera that must see the stripe must see the dark first, in pictures large enough to be judged: otherwise it would
/// silently testify to nothing.
/// Errors: InputError, one line that names the camera and the cure, unless the settings waive it.
void check_witness(const ScanPlan& plan, const BeamSettings& settings, const CameraInfo& camera, RecordWhen record);

}  // namespace tankrig
