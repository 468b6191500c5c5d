// Ambient light over an image: computed on a coarse grid, interpolated along flat surfaces, computed anew elsewhere.
#pragma once

#include <vector>

#include "sim_backends/world/radiometry.hpp"

namespace tankrig::sim {

/// Threads: const calls from any.
class AmbientGrid {
 public:
  static constexpr int kStep = 8;  ///< pixels between nodes

  /// `nodes`: what is seen at pixels (kStep * i, kStep * j), row-major, `columns` wide; surface -1 where nothing is.
  AmbientGrid(std::vector<SurfaceHit> nodes, int columns, const Radiometry& radiometry);

  /// Ambient illuminance at `hit`, seen at pixel coordinates (u, v) [lux].
  Rgb at(const SurfaceHit& hit, float u, float v) const;

 private:
  std::vector<SurfaceHit> nodes_;
  std::vector<Rgb> light_;
  int columns_, rows_;
  const Radiometry* radiometry_;
};

/// Whether both lie on one flat piece of one surface.
bool same_plane(const SurfaceHit& a, const SurfaceHit& b);

}  // namespace tankrig::sim
