// How the command line names the format of a camera file.
#pragma once

#include <filesystem>
#include <string>

#include "apps/tankrig/command_line/command_line.hpp"
#include "core/camera_file.hpp"

namespace tankrig::app {

struct CameraFileFormatOption {
  std::string name;  ///< empty: by the file's extension

  /// Errors: InputError of an extension that no format has.
  CameraFileFormat of(const std::filesystem::path& file) const;
};
void add_camera_format_option(CLI::App* command, CameraFileFormatOption& option);

}  // namespace tankrig::app
