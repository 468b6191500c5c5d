// What a plan's light must keep to, known before anything moves.
#pragma once

#include <optional>

#include "rig/plan/scan_plan.hpp"
#include "rig/safety/safety_settings.hpp"

namespace tankrig {

/// When the plan first asks for light [s]; nothing if it never does.
std::optional<double> first_light(const ScanPlan& plan);

/// Every stretch of light within maximum_on, every hold within hold_limit and without motion; dark pauses shorter than
/// indicator_delay belong to their stretch.  Errors: InputError, one line that names the key.
void check_light(const ScanPlan& plan, const SafetySettings& settings);

}  // namespace tankrig
