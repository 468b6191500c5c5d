#include "bench/report/cloud_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "bench/report/base64.hpp"
#include "bench/report/web_programs.hpp"
#include "core/camera_model.hpp"

namespace tankrig {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostShown = 40'000;

ordered_json to_json(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

ordered_json to_json(const ViewedCloud& viewed) {
  const auto& points = viewed.cloud.points;
  double reach = 1e-3;
  for (const CloudPoint& point : points)
    if (point.p.allFinite()) reach = std::max(reach, point.p.cwiseAbs().maxCoeff());
  const double step = reach / INT16_MAX;
  const std::size_t every = std::max<std::size_t>(1, (points.size() + kMostShown - 1) / kMostShown);
  std::string places, verdicts;
  for (std::size_t i = 0; i < points.size(); i += every) {
    if (!points[i].p.allFinite()) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = static_cast<std::int16_t>(std::lround(points[i].p[axis] / step));
      places += static_cast<char>(value & 0xff);
      places += static_cast<char>(value >> 8 & 0xff);
    }
    verdicts += static_cast<char>(viewed.verdicts[i]);
  }
  return {{"name", viewed.name},          {"step_m", step},           {"points", base64(places)},
          {"verdicts", base64(verdicts)}, {"shown", verdicts.size()}, {"all", points.size()}};
}

}  // namespace

ViewedLines camera_pyramid(const std::string& name, const CameraModel& model, const Transform& oMc) {
  constexpr double kLength = 0.15;  // [m]
  const double right = model.width - 0.5, bottom = model.height - 0.5;
  const Vector3d corners[] = {model.ray(-0.5, -0.5), model.ray(right, -0.5), model.ray(right, bottom),
                              model.ray(-0.5, bottom)};
  ViewedLines lines{name, {}};
  for (int i = 0; i < 4; ++i) {
    lines.points.push_back(oMc.translation());
    for (const Vector3d& corner : {corners[i], corners[(i + 1) % 4]})
      lines.points.push_back(oMc * Vector3d(corner * kLength / corner.z()));
  }
  lines.points.push_back(oMc.translation());
  return lines;
}

std::string cloud_view_json(const TriangleMesh& object, const std::vector<ViewedCloud>& clouds,
                            const std::vector<ViewedLines>& rig) {
  ordered_json scene{{"vertices", ordered_json::array()},
                     {"triangles", ordered_json::array()},
                     {"clouds", ordered_json::array()},
                     {"rig", ordered_json::array()}};
  for (const Vector3d& vertex : object.vertices) scene["vertices"].push_back(to_json(vertex));
  for (const Eigen::Vector3i& t : object.triangles) scene["triangles"].push_back({t.x(), t.y(), t.z()});
  for (const ViewedCloud& cloud : clouds) scene["clouds"].push_back(to_json(cloud));
  for (const ViewedLines& lines : rig) {
    ordered_json points = ordered_json::array();
    for (const Vector3d& p : lines.points) points.push_back(to_json(p));
    scene["rig"].push_back({{"name", lines.name}, {"points", points}});
  }
  return script_json(scene);
}

}  // namespace tankrig
