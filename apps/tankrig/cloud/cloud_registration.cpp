// `tankrig cloud align` and `merge`: clouds laid on meshes and on each other.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/cloud/cloud_command.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/results/summary.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "bench/metrics/alignment.hpp"
#include "core/atomic_file.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/shown_text.hpp"
#include "pipeline/reconstruct_session.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "reconstruction/pointcloud/cloud_filters.hpp"
#include "reconstruction/pointcloud/floor.hpp"
#include "reconstruction/pointcloud/normals.hpp"
#include "reconstruction/pointcloud/turned_views.hpp"
#include "session/recording/session_lock.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

PointCloud without_floor(const PointCloud& cloud, const Vector3d& up) {
  const auto floor = find_floor(cloud, up);
  return floor ? without(cloud, floor->points) : cloud;
}

PointCloud surface_of(const fs::path& mesh) { return surface_cloud(ObjectSurface(read_mesh(mesh))); }

/// A session's cloud in the object's frame as its rig file has it, with normals on its camera's side.
PointCloud cloud_of_session(const fs::path& given, const std::string& method, Progress& progress) {
  const fs::path path = session_path(given);
  const SessionLock at_rest(path, SessionUse::kRead);
  const Session session = open_with_warnings(path, progress).session;
  if (!session.info.object) throw InputError(path, "has no object whose pose is known, expected a scan, or a cloud");
  const fs::path file = path / "clouds" / (method + ".ply");
  if (!fs::exists(file)) throw InputError(file, "is not there, expected the cloud of `tankrig reconstruct`");
  const Transform oMb = session.info.object->bMo.inverse();
  const CalibratedCamera& camera = session.camera(by_laser(method) ? CameraRole::kMono : CameraRole::kLeft);
  return with_normals(transformed(oMb, read_cloud(file), "o"), kNormalRadius, oMb * camera.bMc.translation());
}

CloudEncoding encoding_of(bool ascii) { return ascii ? CloudEncoding::kAscii : CloudEncoding::kBinary; }

}  // namespace

int cloud_align(const CloudAlignOptions& options) {
  for (const fs::path& out : {options.out, options.pose_out}) check_new_file(out);
  const PointCloud cloud = read_cloud(options.cloud);
  const PointCloud surface = options.to.empty() ? surface_of(options.object) : read_cloud(options.to);
  if (!surface.has_normals())
    throw InputError(options.to, "not every point has a normal, expected a cloud of `tankrig cloud normals`");
  Transform sMc = Transform::Identity();
  const bool same_frame = !cloud.frame.empty() && cloud.frame == surface.frame;
  if (!options.pose.empty()) {
    const ConfigNode pose = ConfigNode::load(options.pose);
    sMc = pose.as_transform().inverse();
    pose.finish();
  }
  MergeSettings settings;
  const bool placed = same_frame || !options.pose.empty();
  PointCloud alone = cloud;
  if (!placed || !options.up.empty() || up_in(cloud.frame)) {
    settings.up = up_of(options.cloud, cloud, options.up);
    alone = without_floor(cloud, settings.up);
  }
  for (CloudPoint& point : alone.points) point.normal.setZero();
  const Registration found =
      merge_views(&surface, {{options.cloud.string(), transformed(sMc, alone, surface.frame), placed}}, settings)
          .placed.front();
  const Transform moved = found.aMb * sMc;

  if (!options.out.empty())
    write_cloud(options.out, transformed(moved, cloud, surface.frame), encoding_of(options.ascii));
  if (!options.pose_out.empty()) write_file_durably(options.pose_out, yaml_of(moved.inverse()) + "\n");
  Registration whole = found;
  whole.aMb = moved;
  const nlohmann::json transform = to_json(whole);
  if (options.json)
    print_json({{"frame", surface.frame}, {"transform", transform}});
  else
    std::printf("%s\n", registration_line(transform).c_str());
  return kOk;
}

int cloud_merge(const CloudMergeOptions& options) {
  check_new_file(options.out);
  if (options.inputs.size() < 2) throw InputError("merge: found 1 input, expected two or more");
  Progress progress;
  MergeSettings settings;
  settings.least_share = options.least_share;
  std::vector<TurnedView> views;
  nlohmann::ordered_json inputs = nlohmann::ordered_json::array();
  for (const fs::path& input : options.inputs) {
    const bool session = fs::is_directory(input);
    const PointCloud cloud = session ? cloud_of_session(input, options.method, progress) : read_cloud(input);
    if (!views.empty() && cloud.frame != views.front().cloud.frame)
      throw InputError(input, "is in frame " + shown_text(cloud.frame) + ", expected " +
                                  shown_text(views.front().cloud.frame) + " as the first");
    if (options.object.empty() && !cloud.has_normals())
      throw InputError(input, "not every point has a normal, expected a cloud of `tankrig cloud normals`");
    settings.up = up_of(input, cloud, options.up);
    views.push_back({input.string(), without_floor(cloud, settings.up), session && !options.search});
    inputs.push_back({{"input", input.string()},
                      {"points", views.back().cloud.points.size()},
                      {"floor_points", cloud.points.size() - views.back().cloud.points.size()}});
  }
  const bool to_mesh = !options.object.empty();
  const PointCloud surface = to_mesh ? surface_of(options.object) : PointCloud{};
  const MergedViews merged = merge_views(to_mesh ? &surface : nullptr, views, settings);
  write_cloud(options.out, merged.cloud, encoding_of(options.ascii));
  for (std::size_t i = 0; i < views.size(); ++i)
    if (to_mesh || i > 0) inputs[i]["transform"] = to_json(merged.placed[i]);
  progress.finish_line();
  if (options.json) {
    print_json({{"cloud", options.out.string()},
                {"frame", merged.cloud.frame},
                {"points", merged.cloud.points.size()},
                {"inputs", inputs}});
    return kOk;
  }
  for (const auto& input : inputs)
    std::printf("%s: %s points, %s of the floor left out%s\n", printable(input.at("input").get<std::string>()).c_str(),
                input.at("points").dump().c_str(), input.at("floor_points").dump().c_str(),
                input.contains("transform") ? ("; " + registration_line(input.at("transform"))).c_str() : "");
  std::printf("%zu points in %s (frame %s)\n", merged.cloud.points.size(), printable(options.out.string()).c_str(),
              shown_text(merged.cloud.frame).c_str());
  return kOk;
}

}  // namespace tankrig::app
