#include "bench/metrics/closest_point.hpp"

#include <algorithm>
#include <limits>

namespace tankrig {
namespace {

ClosestPoint closest_on_edges(const TriangleSides& t, const Vector3d& p) {
  const Vector3d corner[3] = {t.a, t.a + t.ab, t.a + t.ac};
  ClosestPoint best;
  double best_squared = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3d side = corner[(k + 1) % 3] - corner[k];
    const double length_squared = side.squaredNorm();
    const double s = length_squared > 0 ? std::clamp(side.dot(p - corner[k]) / length_squared, 0.0, 1.0) : 0.0;
    const Vector3d point = corner[k] + s * side;
    const double squared = (p - point).squaredNorm();
    if (squared >= best_squared) continue;
    best_squared = squared;
    const int feature = s == 0.0 ? 4 + k : s == 1.0 ? 4 + (k + 1) % 3 : 1 + k;
    best = {point, static_cast<TriangleFeature>(feature)};
  }
  return best;
}

}  // namespace

ClosestPoint closest_point(const TriangleSides& t, const Vector3d& p) {
  const Vector3d ap = p - t.a;
  const double d1 = t.ab.dot(ap), d2 = t.ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {t.a, TriangleFeature::kCorner0};

  const Vector3d bp = ap - t.ab;
  const double d3 = t.ab.dot(bp), d4 = t.ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {t.a + t.ab, TriangleFeature::kCorner1};

  const Vector3d cp = ap - t.ac;
  const double d5 = t.ab.dot(cp), d6 = t.ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {t.a + t.ac, TriangleFeature::kCorner2};

  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  const double sum = va + vb + vc;
  if (!(sum > 1e-14 * t.ab.squaredNorm() * t.ac.squaredNorm())) return closest_on_edges(t, p);
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {t.a + t.ab * (d1 / (d1 - d3)), TriangleFeature::kEdge0};
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double s = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {t.a + t.ab + s * (t.ac - t.ab), TriangleFeature::kEdge1};
  }
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {t.a + t.ac * (d2 / (d2 - d6)), TriangleFeature::kEdge2};
  return {t.a + t.ab * (vb / sum) + t.ac * (vc / sum), TriangleFeature::kFace};
}

}  // namespace tankrig
