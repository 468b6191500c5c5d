// Clicking the object's corners in the page: what it is shown, and the file that its clicks become.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "console/server/console.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

/// The corners of the object's box as the rig file has them in the mono camera, so that the page can tell them apart: names,
/// pixels, whether the object hides them, and its edges. Null if there is no such camera or mesh.
nlohmann::ordered_json corners_to_click(const RigConfig& rig);

/// Writes FOLDER/corners.yaml below `sessions`; an earlier one is kept beside it. `wish`: "folder", and "corners" with "name"
/// and "pixel_px" of each. Returns the file's name and that of the earlier one, and asks where the corners snap to, by the
/// lens as the folder's calibration has it, else as `rig`.
/// Errors: InputError naming what is refused: a folder without object.png, a name or pixel that is none.
Granted save_clicked_corners(const std::filesystem::path& sessions, const std::string& rig,
                             const nlohmann::ordered_json& wish);

}  // namespace tankrig::app
