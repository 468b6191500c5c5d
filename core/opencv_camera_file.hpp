// Camera files for OpenCV's own reader, cv::FileStorage: it insists on a first line that other readers of YAML refuse.
#pragma once

#include <filesystem>
#include <string>

#include "core/camera_model.hpp"

namespace tankrig {

/// Read back exactly by FileStorage and by read_camera_file().
/// Errors: InputError naming the file.
void write_opencv_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name);

}  // namespace tankrig
