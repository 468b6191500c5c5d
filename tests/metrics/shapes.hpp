// Surfaces and clouds whose distances, areas and visible parts are known in closed form.
#pragma once

#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "bench/metrics/triangle_mesh.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig::shapes {

/// Axis-aligned box, normals outwards; 12 triangles in the order -x +x -y +y -z +z.
inline TriangleMesh box(const Vector3d& low, const Vector3d& high) {
  TriangleMesh m;
  for (int i = 0; i < 8; ++i)
    m.vertices.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  const int quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    m.triangles.emplace_back(q[0], q[1], q[2]);
    m.triangles.emplace_back(q[0], q[2], q[3]);
  }
  return m;
}

/// The tank's box, 140 x 300 x 160 mm, origin at the centre of its top face.
inline const Vector3d kBoxLow{-0.070, -0.150, -0.160};
inline const Vector3d kBoxHigh{0.070, 0.150, 0.0};
inline TriangleMesh tank_box() { return box(kBoxLow, kBoxHigh); }

/// Square of side 2 * half in z = 0, normal +z.
inline TriangleMesh square(double half) {
  TriangleMesh m;
  m.vertices = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

/// Icosahedron split `levels` times, vertices on the sphere: 20 * 4^levels triangles.
inline TriangleMesh icosphere(double radius, int levels) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh m;
  m.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  m.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [it, added] = middles.try_emplace(std::minmax(a, b), static_cast<int>(m.vertices.size()));
      if (added) m.vertices.push_back((m.vertices[a].normalized() + m.vertices[b].normalized()));
      return it->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (const Eigen::Vector3i& t : m.triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
    }
    m.triangles = std::move(finer);
  }
  for (Vector3d& v : m.vertices) v = radius * v.normalized();
  return m;
}

/// Points of a grid, at most `step` apart and including the border, on the face of `box` where coordinate `axis` is at
/// its low (`side` 0) or high (1) end.
inline void append_face(PointCloud& cloud, const Vector3d& low, const Vector3d& high, int axis, int side, double step) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const int nu = static_cast<int>(std::ceil((high[u] - low[u]) / step));
  const int nv = static_cast<int>(std::ceil((high[v] - low[v]) / step));
  for (int i = 0; i <= nu; ++i)
    for (int j = 0; j <= nv; ++j) {
      CloudPoint point;
      point.p[axis] = side ? high[axis] : low[axis];
      point.p[u] = low[u] + (high[u] - low[u]) * i / nu;
      point.p[v] = low[v] + (high[v] - low[v]) * j / nv;
      cloud.points.push_back(point);
    }
}

inline PointCloud cloud_of(const std::vector<Vector3d>& points) {
  PointCloud cloud;
  cloud.frame = "o";
  for (const Vector3d& p : points) cloud.points.emplace_back().p = p;
  return cloud;
}

inline Vector3d random_unit(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

}  // namespace tankrig::shapes
