#include "calibration/object_pose/object_shape.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace tankrig {
namespace {

const double kSharp = std::cos(20 * 0.017453292519943295);  // of the angle between two faces' normals
constexpr double kTouching = 1e-4;                          // of the object's size

}  // namespace

ObjectShape::ObjectShape(std::vector<Vector3d> vertices, std::vector<Eigen::Vector3i> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)) {
  for (const Vector3d& v : vertices_) bounds_.extend(v);
  std::map<std::pair<int, int>, std::vector<Vector3d>> normals;
  for (const Eigen::Vector3i& t : triangles_) {
    const Vector3d normal = (vertices_[t[1]] - vertices_[t[0]]).cross(vertices_[t[2]] - vertices_[t[0]]).normalized();
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      normals[{low, high}].push_back(normal);
    }
  }
  for (const auto& [ends, of_edge] : normals)
    if (of_edge.size() != 2 || of_edge[0].dot(of_edge[1]) < kSharp)
      edges_.push_back(
          {vertices_[static_cast<std::size_t>(ends.first)], vertices_[static_cast<std::size_t>(ends.second)]});
}

bool ObjectShape::sees(const Vector3d& eye, const Vector3d& p) const {
  const Vector3d way = eye - p;
  const double touching = kTouching * size();
  for (const Eigen::Vector3i& t : triangles_) {
    // T. Moller, B. Trumbore 1997.
    const Vector3d a = vertices_[t[0]], ab = vertices_[t[1]] - a, ac = vertices_[t[2]] - a;
    const Vector3d q = way.cross(ac);
    const double determinant = ab.dot(q);
    if (std::abs(determinant) < 1e-15) continue;
    const Vector3d from = p - a;
    const double u = from.dot(q) / determinant;
    const Vector3d r = from.cross(ab);
    const double v = way.dot(r) / determinant, along = ac.dot(r) / determinant;
    if (u >= 0 && v >= 0 && u + v <= 1 && along * way.norm() > touching && along < 1) return false;
  }
  return true;
}

ObjectShape::SurfaceError ObjectShape::surface_error(const Eigen::Matrix<double, 6, 6>& covariance) const {
  SurfaceError out;
  double area = 0, squares = 0;
  for (const Eigen::Vector3i& t : triangles_) {
    const Vector3d a = vertices_[t[0]], b = vertices_[t[1]], c = vertices_[t[2]];
    const Vector3d twice = (b - a).cross(c - a);
    const double part = twice.norm() / 2;
    if (!(part > 0)) continue;
    const auto variance = [&, normal = Vector3d(twice.normalized())](const Vector3d& p) {
      Eigen::Matrix<double, 6, 1> by;
      by << p.cross(normal), normal;
      return by.dot(covariance * by);
    };
    // Exact for what is quadratic in the place: the middles of the sides.
    for (const Vector3d& p : {Vector3d((a + b) / 2), Vector3d((b + c) / 2), Vector3d((c + a) / 2)})
      squares += part / 3 * variance(p);
    for (const Vector3d& p : {a, b, c}) out.most = std::max(out.most, std::sqrt(std::max(0.0, variance(p))));
    area += part;
  }
  if (area > 0) out.rms = std::sqrt(squares / area);
  return out;
}

}  // namespace tankrig
