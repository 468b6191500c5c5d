// The module tankrig_surface.so: PCL's meshes of clouds. They bring VTK.
#include <pcl/search/kdtree.h>
#include <pcl/surface/gp3.h>
#include <pcl/surface/poisson.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "reconstruction/pointcloud/cloud_mesh.hpp"
#include "reconstruction/pointcloud/pcl_conversion.hpp"

namespace tankrig {
namespace {

using OrientedCloud = pcl::PointCloud<pcl::PointNormal>;

/// The triangles whose corners all satisfy `keep`, and the vertices they use.
template <class Cloud, class Keep>
CloudMesh mesh_of(const Cloud& vertices, const std::vector<pcl::Vertices>& polygons, const std::string& frame,
                  Keep keep) {
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  CloudMesh mesh{frame, {}, {}};
  std::vector<std::uint32_t> number(vertices.size(), kUnused);
  for (const pcl::Vertices& polygon : polygons) {
    if (!std::ranges::all_of(polygon.vertices, keep)) continue;
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto from = static_cast<std::size_t>(polygon.vertices[k]);
      if (number[from] == kUnused) {
        number[from] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(vertices[from].getVector3fMap());
      }
      triangle[k] = number[from];
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

CloudMesh poisson(const PointCloud& cloud, int depth, double trim_m) {
  const QuietPcl quiet;
  const OrientedCloud::Ptr points = to_pcl<pcl::PointNormal>(cloud);
  pcl::Poisson<pcl::PointNormal> surface;
  surface.setDepth(depth);
  surface.setInputCloud(points);
  OrientedCloud vertices;
  std::vector<pcl::Vertices> triangles;
  surface.reconstruct(vertices, triangles);
  if (trim_m <= 0) return mesh_of(vertices, triangles, cloud.frame, [](auto) { return true; });

  pcl::search::KdTree<pcl::PointNormal> tree;
  tree.setInputCloud(points);
  std::vector<char> near(vertices.size());
  std::vector<int> nearest(1);
  std::vector<float> squared(1);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    tree.nearestKSearch(vertices[i], 1, nearest, squared);
    near[i] = squared[0] <= trim_m * trim_m;
  }
  return mesh_of(vertices, triangles, cloud.frame, [&](auto i) { return near[static_cast<std::size_t>(i)] != 0; });
}

CloudMesh greedy(const PointCloud& cloud, double edge_m) {
  const QuietPcl quiet;
  const OrientedCloud::Ptr points = to_pcl<pcl::PointNormal>(cloud);
  pcl::GreedyProjectionTriangulation<pcl::PointNormal> surface;
  surface.setSearchRadius(edge_m);
  surface.setMu(2.5);
  surface.setMaximumNearestNeighbors(100);
  surface.setMaximumSurfaceAngle(std::numbers::pi / 4);
  surface.setMinimumAngle(std::numbers::pi / 18);
  surface.setMaximumAngle(2 * std::numbers::pi / 3);
  surface.setNormalConsistency(true);
  surface.setConsistentVertexOrdering(true);
  const auto tree = std::make_shared<pcl::search::KdTree<pcl::PointNormal>>();
  tree->setInputCloud(points);
  surface.setSearchMethod(tree);
  surface.setInputCloud(points);
  std::vector<pcl::Vertices> triangles;
  surface.reconstruct(triangles);
  return mesh_of(*points, triangles, cloud.frame, [](auto) { return true; });
}

}  // namespace
}  // namespace tankrig

extern "C" {
extern const tankrig::SurfaceMethods tankrig_surface;
const tankrig::SurfaceMethods tankrig_surface{tankrig::poisson, tankrig::greedy};
}
