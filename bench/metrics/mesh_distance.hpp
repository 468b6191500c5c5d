// How far a point is from the object's surface, exactly.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig {

/// The surface seen from one point.
/// Units: metres.
struct SurfaceDistance {
  double distance = 0;         ///< to the nearest triangle, >= 0
  double signed_distance = 0;  ///< negative inside a closed mesh; equals `distance` for an open one
  Vector3d nearest = Vector3d::Zero();
  std::uint32_t triangle = 0;  ///< the lowest index among equally near triangles
};

/// Point-to-triangle distance. Embree's hierarchy (single precision, radii widened by its rounding) only proposes
/// triangles; every distance is computed and compared in double, so the result does not depend on threads, order or
/// instruction set.
/// Frames: the mesh's.
/// Threads: const members from any number of threads.
class MeshDistance {
 public:
  /// Errors: InputError if the mesh has no triangle.
  explicit MeshDistance(const TriangleMesh& mesh);
  ~MeshDistance();
  MeshDistance(MeshDistance&&) noexcept;
  MeshDistance& operator=(MeshDistance&&) noexcept;

  /// Whether inside and outside are defined: the mesh is closed and consistently oriented (either way round).
  bool closed() const;

  /// `p` must be finite.
  SurfaceDistance at(const Vector3d& p) const;

  /// One result per point, in parallel.
  std::vector<SurfaceDistance> at(std::span<const Vector3d> points) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig
