// The commands of `tankrig cloud` that take one cloud and know nothing else.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/cloud/cloud_command.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "reconstruction/pointcloud/cloud_filters.hpp"
#include "reconstruction/pointcloud/cloud_mesh.hpp"
#include "reconstruction/pointcloud/floor.hpp"
#include "reconstruction/pointcloud/normals.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

Vector3d vector_of(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

PointCloud cloud_with_points(const fs::path& file) {
  PointCloud cloud = read_cloud(file);
  if (cloud.points.empty()) throw InputError(file, "found no point, expected a cloud");
  return cloud;
}

/// Reads the cloud, once it is sure that the result may be written.
PointCloud read_input(const CloudOptions& options) {
  check_new_file(options.out);
  return cloud_with_points(options.cloud);
}

int write_result(const CloudOptions& options, const PointCloud& before, const PointCloud& cloud) {
  write_cloud(options.out, cloud, options.ascii ? CloudEncoding::kAscii : CloudEncoding::kBinary);
  if (options.json)
    print_json({{"cloud", options.out.string()},
                {"frame", cloud.frame},
                {"points", cloud.points.size()},
                {"points_read", before.points.size()},
                {"invalid_points", before.invalid}});
  else
    std::printf("%zu of %zu points in %s (frame %s)\n", cloud.points.size(), before.points.size(),
                printable(options.out.string()).c_str(),
                cloud.frame.empty() ? "not named" : shown_text(cloud.frame).c_str());
  return cloud.points.empty() ? kPartial : kOk;
}

}  // namespace

void check_new_file(const fs::path& out) {
  if (out.empty()) return;
  check_in_no_session(out);
  if (fs::exists(out)) throw InputError(out, "exists already, expected a new file");
}

Vector3d up_of(const fs::path& file, const PointCloud& cloud, const std::vector<double>& given) {
  if (!given.empty()) {
    const Vector3d up = vector_of(given);
    if (!(up.norm() > 0)) throw InputError("--up: found 0,0,0, expected a direction");
    return up.normalized();
  }
  if (const auto up = up_in(cloud.frame)) return *up;
  throw InputError(file, "is in frame " + (cloud.frame.empty() ? "not named" : shown_text(cloud.frame)) +
                             ", in which up is not known, expected --up X,Y,Z");
}

PointCloud given_or_made_normals(const fs::path& file, const PointCloud& cloud, const NormalOptions& options) {
  if (options.seen_from.empty() && cloud.has_normals()) return cloud;
  if (options.seen_from.empty() && cloud.frame != "c")
    throw InputError(file, "has no normals, and where its camera stood is not known, expected --seen-from X,Y,Z");
  const Vector3d eye = options.seen_from.empty() ? Vector3d::Zero() : vector_of(options.seen_from);
  PointCloud oriented = with_normals(cloud, options.radius_m, eye);
  if (oriented.points.empty())
    throw InputError(file, "no point has four neighbours within " + std::to_string(options.radius_m) +
                               " m, expected a larger --radius");
  return oriented;
}

int cloud_convert(const CloudConvertOptions& options) {
  const PointCloud before = read_input(options);
  PointCloud cloud = before;
  if (options.millimetres)
    for (CloudPoint& point : cloud.points) {
      point.p *= 1e-3;
      point.sigma *= 1e-3f;
    }
  if (!options.pose.empty()) {
    const ConfigNode pose = ConfigNode::load(options.pose);
    cloud = transformed(pose.as_transform(), cloud, options.frame);
    pose.finish();
  } else if (!options.frame.empty()) {
    cloud.frame = options.frame;
  }
  return write_result(options, before, cloud);
}

int cloud_crop(const CloudCropOptions& options) {
  const Eigen::AlignedBox3d box(vector_of(options.min), vector_of(options.max));
  if (box.isEmpty()) throw InputError("crop: a coordinate of --min is above that of --max");
  const PointCloud before = read_input(options);
  return write_result(options, before, cropped(before, box, options.outside));
}

int cloud_voxel(const CloudVoxelOptions& options) {
  const PointCloud before = read_input(options);
  return write_result(options, before, voxel_grid(before, options.edge_m));
}

int cloud_normals(const CloudNormalsOptions& options) {
  PointCloud before = read_input(options);
  for (CloudPoint& point : before.points) point.normal.setZero();
  return write_result(options, before, given_or_made_normals(options.cloud, before, options));
}

int cloud_outliers(const CloudOutliersOptions& options) {
  const PointCloud before = read_input(options);
  return write_result(options, before, without_outliers(before, {options.neighbours, options.sigmas}));
}

int cloud_floor(const CloudFloorOptions& options) {
  const PointCloud cloud = read_input(options);
  const auto floor = find_floor(cloud, up_of(options.cloud, cloud, options.up), {.band_m = options.band_m});
  if (!floor) throw InputError(options.cloud, "found no floor: no level plane with next to nothing below it");
  if (!options.out.empty())
    write_cloud(options.out, without(cloud, floor->points),
                options.ascii ? CloudEncoding::kAscii : CloudEncoding::kBinary);
  const Vector3d& n = floor->plane.normal;
  if (options.json) {
    nlohmann::ordered_json out{{"plane", {n.x(), n.y(), n.z(), floor->plane.offset}},
                               {"frame", cloud.frame},
                               {"floor_points", floor->points.size()},
                               {"points_read", cloud.points.size()},
                               {"rms_m", floor->rms_m}};
    if (!options.out.empty()) out["cloud"] = options.out.string();
    print_json(out);
  } else {
    std::printf("floor: %.6f,%.6f,%.6f,%.6f (frame %s); %zu of %zu points, rms %.2f mm\n", n.x(), n.y(), n.z(),
                floor->plane.offset, cloud.frame.empty() ? "not named" : shown_text(cloud.frame).c_str(),
                floor->points.size(), cloud.points.size(), 1e3 * floor->rms_m);
  }
  return kOk;
}

int cloud_mesh(const CloudMeshOptions& options) {
  const PointCloud cloud = given_or_made_normals(options.cloud, read_input(options), options);
  const CloudMesh mesh = options.method == "poisson" ? poisson_mesh(cloud, options.depth, options.trim_m)
                                                     : greedy_mesh(cloud, options.edge_m);
  write_mesh(options.out, mesh);
  if (options.json)
    print_json({{"mesh", options.out.string()},
                {"frame", mesh.frame},
                {"vertices", mesh.vertices.size()},
                {"triangles", mesh.triangles.size()}});
  else
    std::printf("%zu triangles, %zu vertices in %s (frame %s)\n", mesh.triangles.size(), mesh.vertices.size(),
                printable(options.out.string()).c_str(),
                mesh.frame.empty() ? "not named" : shown_text(mesh.frame).c_str());
  return kOk;
}

}  // namespace tankrig::app
