// `tankrig evaluate --definition tanks_and_temples` and `eth3d`: a cloud by the definitions of two well-known benchmarks, as it
// was given and as it lies best on the object.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "bench/metrics/metrics.hpp"

namespace tankrig::app {

struct PeerOptions {
  bool eth3d = false;
  double tolerance_m = 0.010;
  std::optional<Vector3d> scanner;  ///< in o; of ETH3D
};

/// The whole surface is the truth of Tanks and Temples, without a crop but the ground; ETH3D's is what the scanner sees.
/// {definition, tolerance_m, ..., "aligned": the same}; `cloud` in o.
nlohmann::json peer_scores(const PointCloud& cloud, const ObjectSurface& object, const MetricThresholds& thresholds,
                           const PeerOptions& options);

std::string peer_table(const nlohmann::json& score);

}  // namespace tankrig::app
