#include "calibration/object_pose/corners_file.hpp"

#include <fmt/core.h>

#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

/// Of the bounding box; `name` is one of its corners.
Vector3d box_corner(const std::string& name, const ObjectShape& shape) {
  Vector3d o;
  for (int k = 0; k < 3; ++k)
    o[k] = name[static_cast<std::size_t>(2 * k)] == '+' ? shape.bounds().max()[k] : shape.bounds().min()[k];
  return o;
}

}  // namespace

bool is_box_corner(const std::string& name) {
  if (name.size() != 6) return false;
  for (std::size_t k = 0; k < 3; ++k)
    if ((name[2 * k] != '+' && name[2 * k] != '-') || name[2 * k + 1] != "xyz"[k]) return false;
  return true;
}

CornersFile read_corners(const std::filesystem::path& file) {
  const ConfigNode root = ConfigNode::load(file);
  CornersFile out;
  for (const auto& [key, path] :
       {std::pair{"image", &out.image}, std::pair{"camera", &out.camera}, std::pair{"object", &out.object}})
    if (root.has(key)) *path = root.path(key);
  if (root.has("most_rms_px")) out.most_rms_px = root.number("most_rms_px", {0.01, 100});
  for (const ConfigNode& node : root.items("corners")) {
    CornersFile::Corner corner;
    corner.name = node.text("name");
    if (node.has("point_m")) {
      corner.o = read_vector(node, "point_m");
    } else if (!is_box_corner(corner.name)) {
      node.fail("name",
                "found '" + shown_text(corner.name) +
                    "', expected a corner of the object's bounding box, like +x-y+z, or a point_m beside the name");
    }
    const std::vector<double> pixel = node.numbers("pixel_px", 2);
    corner.pixel = {pixel[0], pixel[1]};
    if (!(corner.pixel.cwiseAbs().maxCoeff() < kMostCornerPixels))
      node.fail("pixel_px", "found a place that is in no picture");
    node.finish();
    for (const CornersFile::Corner& other : out.corners)
      if (other.name == corner.name)
        node.fail("name", "found '" + shown_text(corner.name) + "' twice, expected each corner once");
    out.corners.push_back(corner);
  }
  root.finish();
  return out;
}

std::string corners_text(const std::string& clicked_by, const std::vector<CornersFile::Corner>& corners) {
  std::string text = "# Clicked by " + clicked_by + ".\ncorners:\n";
  for (const CornersFile::Corner& corner : corners)
    text += fmt::format("  - {{name: \"{}\", pixel_px: [{:.2f}, {:.2f}]}}\n", corner.name, corner.pixel.x(),
                        corner.pixel.y());
  return text;
}

std::vector<std::pair<std::string, Vector3d>> bounding_corners(const ObjectShape& shape) {
  std::vector<std::pair<std::string, Vector3d>> out;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::string name;
    for (unsigned axis = 0; axis < 3; ++axis) name += {corner >> axis & 1 ? '+' : '-', "xyz"[axis]};
    out.emplace_back(name, box_corner(name, shape));
  }
  return out;
}

std::vector<ClickedCorner> clicked_corners(const CornersFile& file, const ObjectShape& shape) {
  std::vector<ClickedCorner> out;
  for (const CornersFile::Corner& c : file.corners)
    out.push_back({c.name, c.o ? *c.o : box_corner(c.name, shape), c.pixel, 1});
  return out;
}

}  // namespace tankrig
