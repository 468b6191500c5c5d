#include "reconstruction/pointcloud/cloud_mesh.hpp"

#include <pcl/search/kdtree.h>
#include <pcl/surface/gp3.h>
#include <pcl/surface/poisson.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "core/input_error.hpp"
#include "reconstruction/pointcloud/pcl_conversion.hpp"

namespace tankrig {
namespace {

using OrientedCloud = pcl::PointCloud<pcl::PointNormal>;

OrientedCloud::Ptr oriented(const PointCloud& cloud) {
  if (!cloud.has_normals()) throw InputError("mesh: not every point has a normal, expected normals");
  return to_pcl<pcl::PointNormal>(cloud);
}

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

}  // namespace

CloudMesh poisson_mesh(const PointCloud& cloud, int depth, double trim_m) {
  const QuietPcl quiet;
  const OrientedCloud::Ptr points = oriented(cloud);
  pcl::Poisson<pcl::PointNormal> poisson;
  poisson.setDepth(depth);
  poisson.setInputCloud(points);
  OrientedCloud vertices;
  std::vector<pcl::Vertices> triangles;
  poisson.reconstruct(vertices, triangles);
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

CloudMesh greedy_mesh(const PointCloud& cloud, double edge_m) {
  const QuietPcl quiet;
  const OrientedCloud::Ptr points = oriented(cloud);
  pcl::GreedyProjectionTriangulation<pcl::PointNormal> greedy;
  greedy.setSearchRadius(edge_m);
  greedy.setMu(2.5);
  greedy.setMaximumNearestNeighbors(100);
  greedy.setMaximumSurfaceAngle(std::numbers::pi / 4);
  greedy.setMinimumAngle(std::numbers::pi / 18);
  greedy.setMaximumAngle(2 * std::numbers::pi / 3);
  greedy.setNormalConsistency(true);
  greedy.setConsistentVertexOrdering(true);
  const auto tree = std::make_shared<pcl::search::KdTree<pcl::PointNormal>>();
  tree->setInputCloud(points);
  greedy.setSearchMethod(tree);
  greedy.setInputCloud(points);
  std::vector<pcl::Vertices> triangles;
  greedy.reconstruct(triangles);
  return mesh_of(*points, triangles, cloud.frame, [](auto) { return true; });
}

}  // namespace tankrig
