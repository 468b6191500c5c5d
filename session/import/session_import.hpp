// Sessions from other people's photographs: a folder of images, a camera file and the laser's plane.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/camera_model.hpp"
#include "core/frames.hpp"

namespace tankrig {

/// Order of file names with numbers counted: frame2 before frame10.
bool natural_less(std::string_view a, std::string_view b);

/// The images of a folder, in natural order of their names.
/// Errors: InputError if it is no folder, or has none.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// The arguments of `tankrig session import`. Exactly one of `plane` and `planes` is set.
struct ImportRequest {
  std::filesystem::path images;               ///< folder; .png .jpg .jpeg .bmp .tif .tiff .pgm .ppm
  CameraModel camera;                         ///< every image must have its size
  std::optional<Plane> plane;                 ///< in the camera frame, for all images
  std::map<std::string, Plane> planes;        ///< in the camera frame, by file name; one for every image
  std::optional<std::filesystem::path> dark;  ///< folder of images with the laser off
  std::filesystem::path out;                  ///< the session; must not exist
  std::string operator_name, notes, software;
};

/// Writes a session of kind "import": the images unchanged, in natural order, then the dark ones as dark_before. It is
/// built beside `out` and renamed at the end, so no partial session gets that name. Images that are no whole picture
/// are left out, each with an event; returns what is wrong with them, a line each.
/// Errors: InputError naming the file, what was found and what was expected.
std::vector<std::string> write_import_session(const ImportRequest& request);

}  // namespace tankrig
