// Weights of the pixel filter.
#include "sim_backends/world/point_spread.hpp"

#include <cmath>
#include <numbers>

namespace tankrig::sim {

PixelFilter::PixelFilter(double sigma_px, int per_pixel_along_axis)
    : per_pixel(per_pixel_along_axis), reach(static_cast<int>(std::ceil(3.5 * sigma_px * per_pixel_along_axis))) {
  const int n = per_pixel + 2 * reach;
  std::vector<double> w(n);
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double s = (i - reach + 0.5) / per_pixel - 0.5;  // from the pixel's centre, in pixels
    const double k = 1 / (std::max(sigma_px, 1e-6) * std::numbers::sqrt2);
    w[i] = std::erf((s + 0.5) * k) - std::erf((s - 0.5) * k);
    sum += w[i];
  }
  for (const double x : w) weights.push_back(static_cast<float>(x / sum));
}

}  // namespace tankrig::sim
