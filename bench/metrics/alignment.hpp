// A cloud's score after it was laid on the object: what is left of its error once the pose's is taken off.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "bench/metrics/metrics.hpp"
#include "reconstruction/pointcloud/registration.hpp"

namespace tankrig {

/// The object's surface as a cloud with normals, frame o: what clouds are registered to.
PointCloud surface_cloud(const ObjectSurface& object);

struct AlignedScore {
  Registration registration;  ///< a is o, b the cloud as it was given in o
  std::string doubt;          ///< why there is no score; empty: there is one
  std::optional<Metrics> metrics;
};

/// Registers `cloud` to the object by its points that `unaligned` does not take for ground, partners being within three
/// times the inlier threshold at first and within the threshold in the end, and scores these points there. The ground
/// does not lie on the object: it must not count where the motion lifts it.
/// Frames: `cloud` in o.
AlignedScore evaluate_aligned(const PointCloud& cloud, const ObjectSurface& object, const MetricThresholds& thresholds,
                              const Metrics& unaligned);

/// The metrics' keys and `transform`; or, without a score, `refused` and `transform`.
nlohmann::json to_json(const AlignedScore& score);

/// translation_m, rotation_deg, matrix (4 rows: p_a = matrix * p_b), pairs, share, fit, rms_m, firmness.
nlohmann::json to_json(const Registration& registration);

}  // namespace tankrig
