#include "bench/metrics/pseudo_normals.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace tankrig {
namespace {

double angle_between(const Vector3d& u, const Vector3d& v) { return std::atan2(u.cross(v).norm(), u.dot(v)); }

struct EdgeSide {
  int low, high, triangle, side;
};

}  // namespace

PseudoNormals::PseudoNormals(const TriangleMesh& welded)
    : triangles_(welded.triangles),
      face_(welded.triangles.size()),
      edge_(welded.triangles.size()),
      corner_(welded.vertices.size(), Vector3d::Zero()) {
  std::vector<EdgeSide> sides;
  sides.reserve(3 * triangles_.size());
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Eigen::Vector3i& t = triangles_[i];
    const Vector3d &a = welded.vertices[t[0]], &b = welded.vertices[t[1]], &c = welded.vertices[t[2]];
    const Vector3d cross = (b - a).cross(c - a);
    face_[i] = cross.norm() > 0 ? Vector3d(cross.normalized()) : Vector3d(Vector3d::Zero());
    const Vector3d* corners[3] = {&a, &b, &c};
    for (int k = 0; k < 3; ++k) {
      const Vector3d& here = *corners[k];
      corner_[t[k]] += angle_between(*corners[(k + 1) % 3] - here, *corners[(k + 2) % 3] - here) * face_[i];
      const int next = t[(k + 1) % 3];
      sides.push_back({std::min(t[k], next), std::max(t[k], next), static_cast<int>(i), k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
    return std::tie(a.low, a.high, a.triangle, a.side) < std::tie(b.low, b.high, b.triangle, b.side);
  });
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    Vector3d sum = Vector3d::Zero();
    for (end = begin; end < sides.size() && sides[end].low == sides[begin].low && sides[end].high == sides[begin].high;
         ++end)
      sum += face_[sides[end].triangle];
    for (std::size_t k = begin; k < end; ++k) edge_[sides[k].triangle][sides[k].side] = sum;
  }
}

const Vector3d& PseudoNormals::at(std::size_t triangle, TriangleFeature feature) const {
  const int code = static_cast<int>(feature);
  if (code == 0) return face_[triangle];
  if (code <= 3) return edge_[triangle][code - 1];
  return corner_[triangles_[triangle][code - 4]];
}

}  // namespace tankrig
