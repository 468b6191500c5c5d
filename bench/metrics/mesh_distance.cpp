#include "bench/metrics/mesh_distance.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <cmath>
#include <limits>
#include <optional>

#include "bench/metrics/closest_point.hpp"
#include "bench/metrics/embree_handles.hpp"
#include "bench/metrics/pseudo_normals.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

struct Query {
  const TriangleSides* triangles;
  Vector3d p;
  double slack;  ///< bound on the rounding of the hierarchy's boxes and of p to single precision [m]
  double squared = std::numeric_limits<double>::infinity();
  ClosestPoint closest{};
  std::uint32_t triangle = std::numeric_limits<std::uint32_t>::max();

  bool improve(std::uint32_t candidate) {
    const ClosestPoint here = closest_point(triangles[candidate], p);
    const double here_squared = (p - here.point).squaredNorm();
    if (here_squared > squared || (here_squared == squared && candidate >= triangle)) return false;
    squared = here_squared;
    closest = here;
    triangle = candidate;
    return true;
  }

  float radius() const { return static_cast<float>(std::sqrt(squared) * (1 + 1e-6) + slack); }
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<Query*>(arguments->userPtr);
  if (!query.improve(arguments->primID)) return false;
  arguments->query->radius = query.radius();
  return true;
}

/// The lowest 10 bits of `value`, two zeros between each.
std::uint64_t spread_bits(std::uint64_t value) {
  value = (value | value << 16) & 0x30000FF;
  value = (value | value << 8) & 0x300F00F;
  value = (value | value << 4) & 0x30C30C3;
  return (value | value << 2) & 0x9249249;
}

/// Indices of `points` in the order of a space-filling (Morton) curve: neighbours in the list are neighbours in space,
/// so the triangle found for one is a good first guess for the next and its part of the hierarchy is in the cache.
std::vector<std::uint32_t> along_a_curve(std::span<const Vector3d> points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  const Vector3d scale = 1023.0 * (box.sizes().array() + 1e-300).inverse();
  std::vector<std::uint64_t> keys(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d cell = (points[i] - box.min()).cwiseProduct(scale).cwiseMin(1023.0);
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) key |= spread_bits(static_cast<std::uint64_t>(cell[axis])) << axis;
    keys[i] = key << 32 | i;
  }
  tbb::parallel_sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i]);
  return order;
}

}  // namespace

struct MeshDistance::Impl {
  EmbreeDevice device;
  EmbreeScene scene;
  std::vector<TriangleSides> triangles;
  std::optional<PseudoNormals> normals;  ///< of a closed mesh
  double outward = 1;
  double extent = 0;  ///< largest absolute coordinate

  SurfaceDistance find(const Vector3d& p, std::uint32_t hint) const {
    Query query{triangles.data(), p, 1e-6 * (extent + p.cwiseAbs().maxCoeff())};
    query.improve(hint);
    RTCPointQuery point;
    point.x = static_cast<float>(p.x());
    point.y = static_cast<float>(p.y());
    point.z = static_cast<float>(p.z());
    point.time = 0;
    point.radius = query.radius();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene.get(), &point, &context, visit, &query);

    SurfaceDistance result;
    result.distance = result.signed_distance = std::sqrt(query.squared);
    result.nearest = query.closest.point;
    result.triangle = query.triangle;
    if (normals) {
      const double side = outward * normals->at(query.triangle, query.closest.feature).dot(p - query.closest.point);
      if (side < 0) result.signed_distance = -result.distance;
    }
    return result;
  }
};

MeshDistance::MeshDistance(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  if (mesh.triangles.empty()) throw InputError("mesh has no triangle, expected a surface");
  const TriangleMesh welded = weld(mesh);
  impl_->device = make_embree_device("");
  impl_->scene.reset(rtcNewScene(impl_->device.get()));
  rtcSetSceneBuildQuality(impl_->scene.get(), RTC_BUILD_QUALITY_HIGH);
  attach_mesh(impl_->device.get(), impl_->scene.get(), welded);
  rtcCommitScene(impl_->scene.get());

  impl_->triangles.reserve(welded.triangles.size());
  for (const Eigen::Vector3i& t : welded.triangles) {
    const Vector3d& a = welded.vertices[t[0]];
    impl_->triangles.push_back({a, welded.vertices[t[1]] - a, welded.vertices[t[2]] - a});
    for (int k = 0; k < 3; ++k) impl_->extent = std::max(impl_->extent, welded.vertices[t[k]].cwiseAbs().maxCoeff());
  }
  const MeshTopology shape = topology(welded);
  if (shape.closed) {
    impl_->normals.emplace(welded);
    impl_->outward = shape.outward ? 1 : -1;
  }
}

MeshDistance::~MeshDistance() = default;
MeshDistance::MeshDistance(MeshDistance&&) noexcept = default;
MeshDistance& MeshDistance::operator=(MeshDistance&&) noexcept = default;

bool MeshDistance::closed() const { return impl_->normals.has_value(); }

SurfaceDistance MeshDistance::at(const Vector3d& p) const { return impl_->find(p, 0); }

std::vector<SurfaceDistance> MeshDistance::at(std::span<const Vector3d> points) const {
  std::vector<SurfaceDistance> result(points.size());
  const std::vector<std::uint32_t> order = along_a_curve(points);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 256), [&](const auto& range) {
    std::uint32_t hint = 0;
    for (std::size_t k = range.begin(); k < range.end(); ++k) {
      const std::uint32_t i = order[k];
      result[i] = impl_->find(points[i], hint);
      hint = result[i].triangle;
    }
  });
  return result;
}

}  // namespace tankrig
