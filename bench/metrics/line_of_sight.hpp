// Whether anything stands between two points.
#pragma once

#include <memory>
#include <vector>

#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig {

/// Straight lines of sight among meshes that share one frame, by ray casting. Cast with one instruction set on every
/// machine, so that grazing rays fall alike everywhere.
/// Threads: const members from any number of threads.
class LineOfSight {
 public:
  explicit LineOfSight(const std::vector<const TriangleMesh*>& meshes);
  ~LineOfSight();
  LineOfSight(LineOfSight&&) noexcept;
  LineOfSight& operator=(LineOfSight&&) noexcept;

  /// No triangle on the open segment; both ends must be clear of the surfaces by more than 1e-6 of the coordinates.
  bool clear(const Vector3d& from, const Vector3d& to) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig
