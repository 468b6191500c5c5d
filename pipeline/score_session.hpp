// From clouds to scores: every method against the session's object.
#pragma once

#include <atomic>
#include <nlohmann/json.hpp>
#include <vector>

#include "pipeline/reconstruct_session.hpp"

namespace tankrig {

/// One method of a session, reconstructed and scored.
struct Score {
  Reconstruction reconstruction;
  Metrics metrics;
  Ceiling ceiling;
  nlohmann::json json;  ///< what is printed, and stored in results/

  const std::string& method() const { return reconstruction.method; }
};

/// Whether the session has the cameras that a method needs.
bool has_cameras(const Session& session, const std::string& method);

/// The session's object, prepared for scoring.
/// Errors: InputError if the session has none.
ObjectSurface object_of(const Session& session, const MetricThresholds& thresholds);

/// The reconstruction's cloud in the object's frame o.
PointCloud cloud_in_object(const Session& session, const Reconstruction& reconstruction);

/// What `method` could have seen of the object in this session: the same for every light and noise.
/// Errors: InputError if the session has no calibration to compute it from.
Ceiling session_ceiling(const Session& session, const ObjectSurface& object, const std::string& method,
                        const MetricThresholds& thresholds);

/// One method's figures; writes nothing.
/// Errors: InputError if the session has no calibration to compute the coverage ceiling.
Score score_reconstruction(const Session& session, const MetricThresholds& thresholds, const ObjectSurface& object,
                           Reconstruction reconstruction);
/// The same with session_ceiling(), made before.
Score score_reconstruction(const Session& session, const MetricThresholds& thresholds, const ObjectSurface& object,
                           Reconstruction reconstruction, Ceiling ceiling);

/// All methods the session has cameras for: writes clouds and results/METHOD.json, scores against `object`. Returns
/// early, with the methods done, if `stop` is set. `ready`: scores of this session that need not be made again.
std::vector<Score> reconstruct_and_score(const Session& session, const PipelineParameters& parameters,
                                         const ObjectSurface& object, const std::atomic<bool>& stop,
                                         const ProgressCallback& progress = {}, std::vector<Score> ready = {});

/// {METHOD: score, ...}
nlohmann::ordered_json scores_json(const std::vector<Score>& scores);

/// (method, score) as score_table() takes them.
std::vector<std::pair<std::string, nlohmann::json>> tabled(const std::vector<Score>& scores);

}  // namespace tankrig
