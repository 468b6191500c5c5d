#include "apps/tankrig/serve/click_corners.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/tankrig/calibrate_all/guided_calibration.hpp"
#include "bench/metrics/triangle_mesh.hpp"
#include "calibration/object_pose/corners_file.hpp"
#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kFewest = 4, kBoxCorners = 8;

CornersFile::Corner corner_of(const ordered_json& value) {
  const auto bad = [&](const char* expected) {
    return InputError(fmt::format("corner: found {}, expected {}", shown_text(value.dump()), expected));
  };
  if (!value.is_object() || !value.contains("name") || !value["name"].is_string() || !is_box_corner(value["name"]))
    throw bad("the name of a corner like +x-y+z");
  const ordered_json pixel = value.value("pixel_px", ordered_json());
  if (!pixel.is_array() || pixel.size() != 2 || !pixel[0].is_number() || !pixel[1].is_number())
    throw bad("a pixel_px of column and row");
  const Vector2d place(pixel[0].get<double>(), pixel[1].get<double>());
  if (!(place.cwiseAbs().maxCoeff() < kMostCornerPixels)) throw bad("a pixel of the picture");
  return {value["name"], {}, place};
}

/// Below `sessions`, with the picture in it.
fs::path clicked_folder(const fs::path& sessions, const ordered_json& wish) {
  const std::string name = wish.contains("folder") && wish["folder"].is_string() ? wish["folder"] : "";
  const fs::path folder = sessions / name;
  if (name.empty() || name.starts_with('.') || name.find('/') != std::string::npos || fs::is_symlink(folder) ||
      !fs::is_regular_file(folder / "object.png"))
    throw InputError("folder: found '" + shown_text(name) + "', expected one in " + sessions.string() +
                     " with an object.png: calibrate first, it asks for the corners in its last step");
  return folder;
}

}  // namespace

ordered_json corners_to_click(const RigConfig& rig) {
  const auto camera = std::ranges::find(rig.cameras, CameraRole::kMono, &RigCamera::role);
  if (camera == rig.cameras.end()) return nullptr;
  const Transform cMo = camera->bMc.inverse() * rig.object.bMo;
  const auto pixel_of = [&](const Vector3d& o) {
    const auto pixel = camera->model.project(cMo * o);
    return pixel ? ordered_json{pixel->x(), pixel->y()} : ordered_json();
  };
  try {
    const TriangleMesh mesh = read_mesh(rig.object.mesh);
    const ObjectShape shape(mesh.vertices, mesh.triangles);
    ordered_json out{{"camera", camera->name},
                     {"width_px", camera->model.width},
                     {"height_px", camera->model.height},
                     {"corners", ordered_json::array()},
                     {"edges", ordered_json::array()}};
    for (const auto& [name, o] : bounding_corners(shape))
      out["corners"].push_back(
          {{"name", name}, {"pixel_px", pixel_of(o)}, {"seen", shape.sees(cMo.inverse().translation(), o)}});
    for (const ObjectShape::Edge& edge : shape.edges()) out["edges"].push_back({pixel_of(edge.a), pixel_of(edge.b)});
    return out;
  } catch (const InputError&) {
    return nullptr;  // whoever needs the mesh says what is wrong with it
  }
}

Granted save_clicked_corners(const fs::path& sessions, const std::string& rig, const ordered_json& wish) {
  const fs::path folder = clicked_folder(sessions, wish);
  const ordered_json clicks = wish.value("corners", ordered_json::array());
  if (!clicks.is_array() || clicks.size() < kFewest || clicks.size() > kBoxCorners)
    throw InputError(fmt::format("corners: found {}, expected {} to {}", clicks.is_array() ? clicks.size() : 0, kFewest,
                                 kBoxCorners));
  std::vector<CornersFile::Corner> corners;
  for (const ordered_json& click : clicks) {
    corners.push_back(corner_of(click));
    if (std::ranges::count(corners, corners.back().name, &CornersFile::Corner::name) > 1)
      throw InputError("corners: found " + corners.back().name + " twice, expected each once");
  }
  const fs::path file = folder / "corners.yaml";
  ordered_json answer{{"file", file.string()}};
  if (fs::exists(file)) {
    fs::path kept;
    for (int n = 1; kept.empty() || fs::exists(kept); ++n) kept = folder / fmt::format("corners-{}.yaml", n);
    fs::rename(file, kept);
    answer["kept"] = kept.string();
  }
  write_file_durably(file, corners_text("hand, in the console", corners));
  Granted granted{answer,
                  {"calibrate", "object", "--corners", file.string(), "--image", (folder / "object.png").string(),
                   "--rig", rig, "--json"}};
  for (const char* calibration : {kUnfinishedCalibration, kCalibration})
    if (fs::exists(folder / calibration)) {
      granted.question.insert(granted.question.end(), {"--calibration", (folder / calibration).string()});
      break;
    }
  return granted;
}

}  // namespace tankrig::app
