// The optics' blur and the pixel's area in one filter.
#pragma once

#include <vector>

namespace tankrig::sim {

/// Weights of the sub-pixels (`per_pixel` along one axis) around a pixel: a box one pixel wide convolved with a
/// Gaussian of `sigma_px`. Sums to 1. Element i weighs the sub-pixel per_pixel * pixel + i - reach.
struct PixelFilter {
  int per_pixel = 1;
  int reach = 0;  ///< sub-pixels beyond the pixel's own on each side
  std::vector<float> weights;

  PixelFilter(double sigma_px, int per_pixel_along_axis);
  int size() const { return static_cast<int>(weights.size()); }
};

}  // namespace tankrig::sim
