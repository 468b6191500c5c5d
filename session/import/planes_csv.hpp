// Planes as people write them: a,b,c,d, or a file with one line per image.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/frames.hpp"

namespace tankrig {

/// "a,b,c,d" of ax + by + cz + d = 0, scaled to a unit normal.
/// Errors: InputError.
Plane parse_plane(std::string_view text);

/// The same for a laser plane in the camera frame. A plane through the camera's centre is an error: nothing can be
/// triangulated on it.
Plane parse_laser_plane(std::string_view text);

/// The plane of each image, by file name: lines file,a,b,c,d, or the same columns in the order of a header line.
/// Errors: InputError with file and line, also for a file named twice.
std::map<std::string, Plane> read_planes_csv(const std::filesystem::path& file);

}  // namespace tankrig
