// The tank's surfaces for light: floor, walls and objects in one bounding volume hierarchy.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {

using Vector3f = Eigen::Vector3f;

/// Where a ray meets a surface.
/// Frames: w.
/// Units: metres.
struct SurfaceHit {
  float distance = 0;
  Vector3f p = Vector3f::Zero();
  Vector3f normal = Vector3f::UnitZ();  ///< unit, of the flat triangle, turned towards the ray's origin
  int surface = -1;                     ///< index into RenderGeometry::surface()
};

/// Frames: w.
/// Threads: const calls from any.
class RenderGeometry {
 public:
  enum class Kind { kFloor, kWall, kObject };
  struct Surface {
    Kind kind = Kind::kFloor;
    Material material;
    Eigen::Isometry3f oMw = Eigen::Isometry3f::Identity();  ///< to the texture's own coordinates
    Vector3f inward = Vector3f::Zero();                     ///< of a wall: its normal into the water
    std::shared_ptr<const BoardPrint> print = nullptr;      ///< of a board, in the texture's coordinates
  };

  /// Errors: InputError if an object's mesh cannot be read or holds no triangle.
  explicit RenderGeometry(const Scene& scene);
  ~RenderGeometry();
  RenderGeometry(RenderGeometry&&) noexcept;
  RenderGeometry& operator=(RenderGeometry&&) noexcept;

  std::optional<SurfaceHit> intersect(const Vector3f& origin, const Vector3f& unit_direction, float from = 0) const;
  /// Whether there is a surface between origin + from * direction and origin + to * direction.
  bool occluded(const Vector3f& origin, const Vector3f& unit_direction, float from, float to) const;

  const Surface& surface(int index) const { return surfaces_[index]; }
  Rgb albedo(const SurfaceHit& hit) const;

 private:
  struct Embree;
  void add(const std::vector<Vector3f>& vertices, const std::vector<Eigen::Vector3i>& triangles, Surface surface);

  std::unique_ptr<Embree> embree_;
  std::vector<Surface> surfaces_;
};

}  // namespace tankrig::sim
