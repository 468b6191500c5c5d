// What a calibration found, as the commands write and print it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "calibration/estimate/estimate.hpp"
#include "core/frames.hpp"

namespace tankrig::app {

/// A JSON object of numbers, texts, lists and objects, as YAML block lines.
std::string yaml_text(const nlohmann::ordered_json& object);

/// {translation_m, quaternion_xyzw}
nlohmann::ordered_json pose_json(const Transform& aMb);

/// Name, value, sigma and half width of the 95 % interval in deg, mm or px, and the sigma's effect on the target.
nlohmann::ordered_json estimates_json(const std::vector<Estimate>& estimates);

/// The same as lines for a terminal.
std::string estimate_lines(const std::vector<Estimate>& estimates);

/// "[0.1, 0.2, 0.3] m, quaternion [0, 0, 0, 1]": as a rig file takes it.
std::string pose_line(const Transform& aMb);

/// A picture from a calibration's folder, in grey or as it is.
/// Errors: InputError.
cv::Mat read_picture(const std::filesystem::path& file, int width, int height, bool grey);

}  // namespace tankrig::app
