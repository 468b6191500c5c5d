// Where a rig's guardian reports.
#pragma once

#include <filesystem>

#include "rig/config/rig_config.hpp"
#include "rig/guardian/guardian.hpp"
#include "rig/guardian/guardian_report.hpp"

namespace tankrig::app {

/// Beside the arm's zero, which the next command reads too; a rig without one reports in the folder for temporary files.
std::filesystem::path guardian_report(const RigConfig& rig, const std::filesystem::path& zero_file);

}  // namespace tankrig::app
