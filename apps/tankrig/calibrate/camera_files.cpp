#include "apps/tankrig/calibrate/camera_files.hpp"

#include <algorithm>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig::app {

CameraFileFormat CameraFileFormatOption::of(const std::filesystem::path& file) const {
  const auto named = std::find(kNames<CameraFileFormat>.begin(), kNames<CameraFileFormat>.end(), name);
  if (named != kNames<CameraFileFormat>.end())
    return static_cast<CameraFileFormat>(named - kNames<CameraFileFormat>.begin());
  const std::string extension = file.extension().string();
  if (extension == ".yaml") return CameraFileFormat::kRos;
  if (extension == ".yml") return CameraFileFormat::kOpenCv;
  if (extension == ".cameramodel") return CameraFileFormat::kMrcal;
  if (extension == ".xml") return CameraFileFormat::kVisp;
  throw InputError(file, "found the extension '" + shown_text(extension) +
                             "', expected .yaml (ROS), .yml (OpenCV), .cameramodel (mrcal), .xml (ViSP), or --format");
}

void add_camera_format_option(CLI::App* command, CameraFileFormatOption& option) {
  command
      ->add_option("--format", option.name,
                   "Of the camera file (default: by extension: .yaml ros, .yml opencv, .cameramodel mrcal, .xml visp)")
      ->check(
          CLI::IsMember(std::vector<std::string>(kNames<CameraFileFormat>.begin(), kNames<CameraFileFormat>.end())));
}

}  // namespace tankrig::app
