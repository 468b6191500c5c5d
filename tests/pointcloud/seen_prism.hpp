// Convex prisms and what a camera sees of them: clouds whose truth is known in closed form.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "bench/metrics/triangle_mesh.hpp"
#include "core/angles.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig::shapes {

/// Standing on z = 0, corners of the outline counter-clockwise.
struct Prism {
  std::vector<Vector2d> outline;
  double height = 0.16;
};

/// Five sides at unequal angles: turned, it fits in one place only.
inline Prism odd_prism() {
  const double towards[] = {0, 62, 130, 210, 285}, distance[] = {0.112, 0.118, 0.114, 0.120, 0.111};
  const auto normal = [&](int k) {
    return Vector2d(std::cos(from_degrees(towards[k])), std::sin(from_degrees(towards[k])));
  };
  Prism prism;
  for (int k = 0; k < 5; ++k) {
    Eigen::Matrix2d sides;
    sides << normal(k).transpose(), normal((k + 1) % 5).transpose();
    prism.outline.emplace_back(sides.inverse() * Vector2d(distance[k], distance[(k + 1) % 5]));
  }
  return prism;
}

inline Prism box_prism(double x, double y) {
  return {{{-x / 2, -y / 2}, {x / 2, -y / 2}, {x / 2, y / 2}, {-x / 2, y / 2}}};
}

inline Prism round_prism(double radius) {
  Prism prism;
  for (int k = 0; k < 90; ++k)
    prism.outline.emplace_back(radius * std::cos(k * from_degrees(4)), radius * std::sin(k * from_degrees(4)));
  return prism;
}

inline TriangleMesh mesh_of(const Prism& prism) {
  TriangleMesh mesh;
  const int n = static_cast<int>(prism.outline.size());
  for (const double z : {0.0, prism.height})
    for (const Vector2d& corner : prism.outline) mesh.vertices.emplace_back(corner.x(), corner.y(), z);
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    mesh.triangles.emplace_back(k, next, n + next);
    mesh.triangles.emplace_back(k, n + next, n + k);
    if (k > 1) {
      mesh.triangles.emplace_back(0, k, k - 1);
      mesh.triangles.emplace_back(n, n + k - 1, n + k);
    }
  }
  return mesh;
}

/// What a camera at `eye_o` sees of `mesh`, convex, at no more than 75 degrees: points 3 mm apart with Gaussian noise
/// of `sigma_m` along the normals, which are there too, off by as much as noise of 3 degrees makes them.
inline PointCloud seen(const TriangleMesh& mesh, const Vector3d& eye_o, double sigma_m, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform;
  PointCloud cloud{"o", {}, 0};
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vector3d &a = mesh.vertices[mesh.triangles[i][0]], ab = mesh.vertices[mesh.triangles[i][1]] - a,
                   ac = mesh.vertices[mesh.triangles[i][2]] - a;
    const Vector3d n = ab.cross(ac).normalized();
    const int count = static_cast<int>(triangle_area(mesh, i) / 9e-6 + uniform(random));
    for (int k = 0; k < count; ++k) {
      double u = uniform(random), v = uniform(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vector3d p = a + u * ab + v * ac;
      if (n.dot((eye_o - p).normalized()) < std::cos(from_degrees(75))) continue;
      CloudPoint point;
      point.p = p + sigma_m * gauss(random) * n;
      const Vector3d wobble(gauss(random), gauss(random), gauss(random));
      point.normal = (n + 0.03 * wobble).normalized().cast<float>();
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

}  // namespace tankrig::shapes
