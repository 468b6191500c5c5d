// How far a cloud lies from the scene it was made of.
#pragma once

#include <algorithm>
#include <vector>

#include "reconstruction/cloud/cloud.hpp"
#include "tests/stereo/textured_scene.hpp"

namespace tankrig::testing {

struct CloudErrors {
  std::size_t points = 0;
  double mean = 0;           ///< [m], over points nearer than 10 mm
  double outliers = 1;       ///< share of points beyond 10 mm
  double median_sigmas = 0;  ///< distance over the point's own sigma
};

inline CloudErrors errors(const TexturedScene& scene, const PointCloud& cloud) {
  CloudErrors e;
  e.points = cloud.points.size();
  std::size_t inliers = 0;
  std::vector<double> sigmas;
  for (const CloudPoint& point : cloud.points) {
    const double d = scene.distance(point.p);
    if (d > 0.010) continue;
    ++inliers;
    e.mean += d;
    sigmas.push_back(d / point.sigma);
  }
  if (inliers == 0) return e;
  e.mean /= static_cast<double>(inliers);
  e.outliers = 1.0 - static_cast<double>(inliers) / static_cast<double>(e.points);
  std::nth_element(sigmas.begin(), sigmas.begin() + static_cast<std::ptrdiff_t>(inliers / 2), sigmas.end());
  e.median_sigmas = sigmas[inliers / 2];
  return e;
}

}  // namespace tankrig::testing
