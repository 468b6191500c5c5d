// Nodes of ambient light and their interpolation.
#include "sim_backends/world/ambient_grid.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace tankrig::sim {

bool same_plane(const SurfaceHit& a, const SurfaceHit& b) {
  return a.surface == b.surface && a.surface >= 0 && a.normal.dot(b.normal) > 0.9999f &&
         std::abs(a.normal.dot(b.p - a.p)) < 2e-4f;
}

AmbientGrid::AmbientGrid(std::vector<SurfaceHit> nodes, int columns, const Radiometry& radiometry)
    : nodes_(std::move(nodes)),
      light_(nodes_.size(), Rgb::Zero()),
      columns_(columns),
      rows_(static_cast<int>(nodes_.size()) / columns),
      radiometry_(&radiometry) {
  tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t i) {
    if (nodes_[i].surface >= 0) light_[i] = radiometry.ambient(nodes_[i].p, nodes_[i].normal);
  });
}

Rgb AmbientGrid::at(const SurfaceHit& hit, float u, float v) const {
  const float x = std::max(u, 0.0f) / kStep, y = std::max(v, 0.0f) / kStep;
  const int i = std::min(static_cast<int>(x), columns_ - 2), j = std::min(static_cast<int>(y), rows_ - 2);
  const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  Rgb sum = Rgb::Zero();
  float weights = 0;
  for (int k = 0; k < 4; ++k) {
    const int node = (j + k / 2) * columns_ + i + k % 2;
    const float weight = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy);
    if (weight <= 0 || !same_plane(hit, nodes_[node])) continue;
    sum += weight * light_[node];
    weights += weight;
  }
  if (weights > 0.25f) return sum / weights;
  return radiometry_->ambient(hit.p, hit.normal, 8);
}

}  // namespace tankrig::sim
