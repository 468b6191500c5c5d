#include "reconstruction/pointcloud/cloud_mesh.hpp"

#include "core/input_error.hpp"
#include "core/module.hpp"

namespace tankrig {
namespace {

/// The methods, for a cloud with normals.
const SurfaceMethods& surface_of(const PointCloud& cloud) {
  if (!cloud.has_normals()) throw InputError("mesh: not every point has a normal, expected normals");
  static const auto& methods =
      *static_cast<const SurfaceMethods*>(module_symbol("tankrig_surface.so", "tankrig_surface"));
  return methods;
}

}  // namespace

CloudMesh poisson_mesh(const PointCloud& cloud, int depth, double trim_m) {
  return surface_of(cloud).poisson(cloud, depth, trim_m);
}

CloudMesh greedy_mesh(const PointCloud& cloud, double edge_m) { return surface_of(cloud).greedy(cloud, edge_m); }

}  // namespace tankrig
