// Sessions out of photographs others made: a folder of images, a camera file and the laser's plane.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "core/camera_model.hpp"
#include "core/frames.hpp"

namespace tankrig {

/// Order of file names as people count: frame2 before frame10.
bool natural_less(std::string_view a, std::string_view b);

/// What `tankrig session import` was given. Exactly one of `plane` and `planes` is set.
struct ImportRequest {
  std::filesystem::path images;               ///< folder; .png .jpg .jpeg .bmp .tif .tiff .pgm .ppm
  CameraModel camera;                         ///< every image must have its size
  std::optional<Plane> plane;                 ///< in the camera frame, for all images
  std::map<std::string, Plane> planes;        ///< in the camera frame, by file name; one for every image
  std::optional<std::filesystem::path> dark;  ///< folder of images with the laser off
  std::filesystem::path out;                  ///< the session, not there yet
  std::string operator_name, notes, software;
};

/// Writes a session of kind "import": the images as they are, in natural order, then the dark ones as dark_before.
/// Built beside `out` and renamed at the end: no partial session is left under that name.
/// Errors: InputError naming the file, what was found and expected.
void write_import_session(const ImportRequest& request);

}  // namespace tankrig
