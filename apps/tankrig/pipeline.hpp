// From a session to clouds and scores: every method on the same frames, with the rig file's parameters.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/progress.hpp"
#include "bench/metrics/metrics.hpp"
#include "reconstruction/stereo/paper_stereo.hpp"
#include "reconstruction/stereo/stereo.hpp"
#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "reconstruction/stripe/stripe_reconstruction.hpp"
#include "rig/session/session.hpp"

namespace tankrig::app {

/// The methods in the order they are reported.
inline const std::vector<std::string> kMethods{"laser", "laser_paper", "stereo", "stereo_paper"};

/// The rig file's `reconstruction`, `workspace` and `evaluation` sections.
struct ReconstructionParameters {
  StripeParameters laser;
  PaperStripeParameters laser_paper;
  StereoParameters stereo;
  PaperStereoParameters stereo_paper;
  std::optional<WorkspaceBox> workspace;  ///< in b; points outside are left out of every cloud, and counted
  MetricThresholds thresholds;
};

/// Errors: InputError with file and line; sections that are not there keep their defaults.
ReconstructionParameters reconstruction_parameters(const ConfigNode& rig_file);

/// Of the rig.yaml inside the session; defaults where it has none (an imported session).
ReconstructionParameters reconstruction_parameters(const Session& session);

struct MethodOutcome {
  std::string method;
  PointCloud cloud;             ///< in b for a scan, in c for an imported session
  std::vector<StripeRow> rows;  ///< laser methods: every stripe point
  StripeOrientation orientation = StripeOrientation::kColumns;
  std::size_t rejected = 0;   ///< candidate points turned down by the method
  nlohmann::json rejections;  ///< by reason
  std::string reason;         ///< why the cloud is empty
  double seconds = 0;
  std::optional<Metrics> metrics;  ///< none without an object
  std::optional<Ceiling> ceiling;
  nlohmann::json score;  ///< what is printed and stored in results/
};

/// The session's object, prepared for scoring.  Errors: InputError if the session has none.
ObjectSurface object_of(const Session& session, const MetricThresholds& thresholds);

/// The cloud of `outcome` in the object's frame o.
PointCloud cloud_in_object(const Session& session, const MethodOutcome& outcome);

/// Reconstructs; writes nothing.  Errors: InputError if the session lacks what the method needs.
MethodOutcome reconstruct_session(const Session& session, const ReconstructionParameters& parameters,
                                  const std::string& method, Progress& progress);

/// Writes clouds/METHOD.ply and .pcd, and for the laser methods clouds/METHOD_stripe.csv.
void write_clouds(const Session& session, const MethodOutcome& outcome);

/// All methods: clouds written, scored against `object`, results/METHOD.json written.
std::vector<MethodOutcome> reconstruct_and_score(const Session& session, const ReconstructionParameters& parameters,
                                                 const ObjectSurface& object, Progress& progress);

}  // namespace tankrig::app
