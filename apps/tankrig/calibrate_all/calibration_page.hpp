// A calibration as one page: the verdict, what was found and how well it is known, what that costs, and the pictures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/calibrate_all/joint_step.hpp"
#include "apps/tankrig/calibrate_all/session_problems.hpp"
#include "apps/tankrig/calibrate_all/truth.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

/// How far the stripe lies off the laser's plane, frame by frame, over the elbow's angle, board by board: as SVG.
std::string sheet_chart(const RigConfig& rig, const RigCamera& camera, const Plane& ePl,
                        const std::vector<SheetViews>& boards);

/// `report/calibration.html` in `folder`, with the pictures and the chart that `report` holds already; nothing is loaded from
/// anywhere. `rig`: calibrated; `drawn`: by its file alone.
/// Errors: InputError naming a picture that cannot be read.
void write_calibration_page(const std::filesystem::path& folder, const RigConfig& rig, const RigConfig& drawn,
                            const JointOutcome& joint, const std::optional<TruthComparison>& truth);

}  // namespace tankrig::app
