#include "apps/tankrig/scan/shown_scan.hpp"

#include "apps/tankrig/command_line/feed.hpp"
#include "bench/metrics/triangle_mesh.hpp"
#include "bench/report/cloud_view.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostTriangles = 1000;  // of a mesh that fits into one message

ordered_json json_of(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

ordered_json json_of(const std::vector<Vector3d>& points) {
  ordered_json out = ordered_json::array();
  for (const Vector3d& p : points) out.push_back(json_of(p));
  return out;
}

/// One with more triangles than a message holds is left out.
ordered_json json_of(const TriangleMesh& mesh, const Transform& bMo) {
  if (mesh.triangles.size() > kMostTriangles) return nullptr;
  ordered_json vertices = ordered_json::array(), triangles = ordered_json::array();
  for (const Vector3d& vertex : mesh.vertices) vertices.push_back(json_of(bMo * vertex));
  for (const Eigen::Vector3i& t : mesh.triangles) triangles.push_back({t.x(), t.y(), t.z()});
  return {{"vertices", vertices}, {"triangles", triangles}};
}

ordered_json json_of(const WakeUpCounts::Seen& seen, std::uint64_t overruns) {
  ordered_json out{{"upper_us", ordered_json::array()}, {"counts", seen.counts}};
  for (std::size_t i = 0; i + 1 < WakeUpCounts::kBins; ++i) out["upper_us"].push_back(WakeUpCounts::upper_us(i));
  out["longest_us"] = 1e6 * seconds(seen.longest);
  out["overruns"] = overruns;
  return out;
}

}  // namespace

ordered_json scene_json(const RigConfig& rig) {
  ordered_json scene{{"rig", rig.name}, {"cameras", ordered_json::array()}};
  for (const RigCamera& camera : rig.cameras)
    scene["cameras"].push_back(
        {{"name", camera.name}, {"lines", json_of(camera_pyramid(camera.name, camera.model, camera.bMc).points)}});
  try {
    scene["object"] = json_of(read_mesh(rig.object.mesh), rig.object.bMo);
  } catch (const InputError&) {
  }
  return scene;
}

void show_scene(const RigConfig& rig) {
  if (!Feed::one().heard()) return;
  ordered_json scene = scene_json(rig);
  scene["feed"] = "scene";
  Feed::one().tell(scene);
}

void show_state(const RigConfig& rig, const ScanProgress& progress) {
  if (!Feed::one().heard()) return;
  ordered_json state{{"feed", "state"},
                     {"fraction", progress.fraction},
                     {"phase", to_string(progress.phase)},
                     {"segment", progress.segment}};
  if (progress.q) {
    std::vector<Vector3d> links{Vector3d::Zero()};
    for (const Transform& bMi : rig.arm.link_frames(*progress.q)) links.push_back(bMi.translation());
    state["arm"] = json_of(links);
    for (int j = 0; j < kJoints; ++j) state["joints_deg"][kJointNames[j]] = to_degrees((*progress.q)[j]);
  }
  state["current_a"] = progress.current_a;
  state["armed"] = progress.armed;
  state["interlock_closed"] = progress.interlock_closed;
  state["box_enabled"] = progress.box_enabled ? ordered_json(*progress.box_enabled) : ordered_json();
  state["lit_s"] = progress.lit_s;
  for (const CameraProgress& camera : progress.cameras) state["lost"][camera.name] = camera.left_out;
  if (progress.wake_ups) state["wake_ups"] = json_of(*progress.wake_ups, progress.overruns);
  if (progress.laser) state["laser"] = progress.laser->emitting ? "on" : progress.laser->powered ? "warming up" : "off";
  Feed::one().tell_newest(state);
}

void show_lux(double lux, const std::string& source) {
  if (Feed::one().heard()) Feed::one().tell({{"feed", "lux"}, {"lux", lux}, {"source", source}});
}

void show_end(const EndState& left) {
  if (Feed::one().heard())
    Feed::one().tell({{"feed", "end"}, {"laser_dark", left.laser_dark}, {"arm_at_rest", left.arm_at_rest}});
}

void show_scores(const std::vector<Score>& scores) {
  if (!Feed::one().heard()) return;
  nlohmann::ordered_json shown = nlohmann::ordered_json::array();
  for (const auto& [method, score] : tabled(scores)) {
    shown.push_back({{"method", method}});
    for (const char* figure : {"points", "mean_error_m", "coverage", "coverage_of_ceiling", "outliers"})
      shown.back()[figure] = score.at(figure);
  }
  Feed::one().tell({{"feed", "scores"}, {"scores", shown}});
}

}  // namespace tankrig::app
