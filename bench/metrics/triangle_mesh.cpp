#include "bench/metrics/triangle_mesh.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace tankrig {

double triangle_area(const TriangleMesh& mesh, std::size_t triangle) {
  const Eigen::Vector3i& t = mesh.triangles[triangle];
  const Vector3d& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

double TriangleMesh::area() const {
  double sum = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) sum += triangle_area(*this, i);
  return sum;
}

Eigen::AlignedBox3d TriangleMesh::bounds() const {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3i& t : triangles)
    for (int corner = 0; corner < 3; ++corner) box.extend(vertices[t[corner]]);
  return box;
}

double TriangleMesh::signed_volume() const {
  if (triangles.empty()) return 0;
  const Vector3d origin = bounds().center();
  double sum = 0;
  for (const Eigen::Vector3i& t : triangles)
    sum += (vertices[t[0]] - origin).dot((vertices[t[1]] - origin).cross(vertices[t[2]] - origin));
  return sum / 6.0;
}

TriangleMesh weld(const TriangleMesh& mesh) {
  const auto key = [&](int i) {
    const Vector3d& v = mesh.vertices[i];
    return std::array<double, 3>{v.x(), v.y(), v.z()};
  };
  std::vector<int> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const auto a = key(i), b = key(j);
    return a != b ? a < b : i < j;
  });

  std::vector<int> first(mesh.vertices.size());  // lowest index at the same position
  for (std::size_t k = 0; k < order.size(); ++k)
    first[order[k]] = k > 0 && key(order[k]) == key(order[k - 1]) ? first[order[k - 1]] : order[k];

  TriangleMesh out;
  std::vector<int> index(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (first[i] != static_cast<int>(i)) continue;
    index[i] = static_cast<int>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[i]);
  }
  out.triangles.reserve(mesh.triangles.size());
  for (const Eigen::Vector3i& t : mesh.triangles)
    out.triangles.emplace_back(index[first[t[0]]], index[first[t[1]]], index[first[t[2]]]);
  return out;
}

MeshTopology topology(const TriangleMesh& welded) {
  struct Edge {
    int low, high, direction;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * welded.triangles.size());
  for (const Eigen::Vector3i& t : welded.triangles)
    for (int side = 0; side < 3; ++side) {
      const int a = t[side], b = t[(side + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return std::tie(a.low, a.high) < std::tie(b.low, b.high); });

  MeshTopology result;
  result.closed = !edges.empty() && edges.size() % 2 == 0;
  for (std::size_t i = 0; result.closed && i < edges.size(); i += 2) {
    const Edge &a = edges[i], &b = edges[i + 1];
    const bool pair = a.low == b.low && a.high == b.high && a.direction + b.direction == 0;
    const bool third = i + 2 < edges.size() && edges[i + 2].low == a.low && edges[i + 2].high == a.high;
    result.closed = pair && !third;
  }
  result.outward = result.closed && welded.signed_volume() > 0;
  return result;
}

}  // namespace tankrig
