// plan.csv: a session's copy of the plan, in seconds from the plan's time 0.
#pragma once

#include <filesystem>
#include <string>

#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// One line per segment. Its motion is not written: joints.csv has what the arm did.
std::string plan_csv(const ScanPlan& plan);

/// The segments with their times and phases, without motion: enough to tell which frames belong where.
/// Errors: InputError with file, line and column.
ScanPlan read_plan_csv(const std::filesystem::path& file);

}  // namespace tankrig
