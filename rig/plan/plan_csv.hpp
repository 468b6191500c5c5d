// plan.csv: a scan's plan as its session keeps it, in seconds from the plan's time 0.
#pragma once

#include <filesystem>
#include <string>

#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// One line a segment. Its motion is not written: what the arm did is in joints.csv.
std::string plan_csv(const ScanPlan& plan);

/// The segments with their times and phases, at rest: enough to tell which frames belong where.
/// Errors: InputError with file, line and column.
ScanPlan read_plan_csv(const std::filesystem::path& file);

}  // namespace tankrig
