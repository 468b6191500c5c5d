// Points as nanoflann's trees ask for them.
#pragma once

#include <cstddef>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// The points must outlive it.
struct TreePoints {
  const std::vector<Vector3d>& p;

  std::size_t kdtree_get_point_count() const { return p.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return p[i][static_cast<int>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

}  // namespace tankrig
