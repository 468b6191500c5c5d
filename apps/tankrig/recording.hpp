// The recording part of `tankrig scan`: the rig's devices, the scan, and the session it leaves.
#pragma once

#include <filesystem>

#include "apps/tankrig/arm_motion.hpp"
#include "apps/tankrig/backend.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/progress.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/scan/scan.hpp"

namespace tankrig::app {

/// Errors: InputError unless --lux is "auto" or a number of at least 0.
void check_lux(const std::string& lux);

/// Moves the arm and records the session.
/// Errors: what the disk refuses.
ScanResult record_scan(const ScanOptions& options, const RigConfig& rig, const ScanPlan& plan, Backend& backend,
                       const std::filesystem::path& path, Progress& progress, Motion& motion);

}  // namespace tankrig::app
