// Clicked corners on disk: corners.yaml. Layout: docs/reference/formats.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/object_pose/object_pose.hpp"

namespace tankrig {

inline constexpr double kMostCornerPixels = 1e5;  ///< columns and rows lie below

/// Whether it names a corner of a bounding box: "+x-y+z".
bool is_box_corner(const std::string& name);

struct CornersFile {
  std::filesystem::path image, camera, object;  ///< absolute; empty where the file does not name them
  std::optional<double> most_rms_px;
  struct Corner {
    std::string name;
    std::optional<Vector3d> o;  ///< without it, `name` is a corner of the object's bounding box
    Vector2d pixel = Vector2d::Zero();
  };
  std::vector<Corner> corners;
};

/// Errors: InputError with file, line, key.
CornersFile read_corners(const std::filesystem::path& file);

/// A corners.yaml of corners of the bounding box. `clicked_by`: one line, for its comment.
std::string corners_text(const std::string& clicked_by, const std::vector<CornersFile::Corner>& corners);

/// The corners of the object's bounding box by their names, "-x-y-z" first, in o.
std::vector<std::pair<std::string, Vector3d>> bounding_corners(const ObjectShape& shape);

/// With every point in the object's frame.
std::vector<ClickedCorner> clicked_corners(const CornersFile& file, const ObjectShape& shape);

}  // namespace tankrig
