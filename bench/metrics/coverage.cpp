#include "bench/metrics/coverage.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <nanoflann.hpp>

#include "bench/metrics/tree_points.hpp"

namespace tankrig {
namespace {

/// What a search has found so far: the squared distance to beat.
struct Nearest {
  using DistanceType = double;
  double squared;

  bool full() const { return true; }
  double worstDist() const { return squared; }
  bool addPoint(double found, std::size_t) {
    squared = std::min(squared, found);
    return true;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, TreePoints>, TreePoints, 3>;

/// Squared distance of each sample to the nearest point, or infinity beyond `reach` [m].
std::vector<double> nearest_squared(const std::vector<SurfaceSample>& samples, const std::vector<Vector3d>& points,
                                    double reach) {
  std::vector<double> result(samples.size(), std::numeric_limits<double>::infinity());
  if (points.empty()) return result;
  const TreePoints cloud{points};
  const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  const double reach_squared = reach * reach * (1 + 1e-9);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples.size(), 512), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      Nearest nearest{reach_squared};
      tree.findNeighbors(nearest, samples[i].p.data(), nanoflann::SearchParams());
      if (nearest.squared < reach_squared) result[i] = nearest.squared;
    }
  });
  return result;
}

struct Share {
  double value, sigma;
};

/// Covered share of the samples that count, with its sampling error; nothing counts with all weights 0.
Share covered_share(const std::vector<SurfaceSample>& samples, const std::vector<double>& squared, double threshold,
                    const std::vector<std::uint8_t>* counts) {
  const auto weight = [&](std::size_t i) { return counts && !(*counts)[i] ? 0.0 : double{samples[i].weight}; };
  const auto covered = [&](std::size_t i) { return squared[i] <= threshold * threshold ? 1.0 : 0.0; };
  double whole = 0, part = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    whole += weight(i);
    part += weight(i) * covered(i);
  }
  Share share{part / whole, 0};
  std::vector<double> residuals(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) residuals[i] = weight(i) * (covered(i) - share.value) / whole;
  share.sigma = stratified_sigma(residuals);
  return share;
}

}  // namespace

std::vector<Coverage> surface_coverage(const std::vector<SurfaceSample>& samples, const std::vector<Vector3d>& points,
                                       const std::vector<double>& thresholds, const Ceiling* ceiling) {
  const double reach = thresholds.empty() ? 0.0 : *std::max_element(thresholds.begin(), thresholds.end());
  const std::vector<double> squared = nearest_squared(samples, points, reach);
  std::vector<Coverage> result;
  for (double threshold : thresholds) {
    const Share whole = covered_share(samples, squared, threshold, nullptr);
    Coverage c{threshold, whole.value, whole.sigma, std::nullopt, std::nullopt};
    if (ceiling != nullptr && ceiling->share > 0) {
      const Share visible = covered_share(samples, squared, threshold, &ceiling->reachable);
      c.of_ceiling = visible.value;
      c.of_ceiling_sigma = visible.sigma;
    }
    result.push_back(c);
  }
  return result;
}

}  // namespace tankrig
