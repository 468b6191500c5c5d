// The rig file's `reconstruction`, `workspace` and `evaluation` sections.
#pragma once

#include <optional>

#include "bench/metrics/metrics.hpp"
#include "reconstruction/stereo/paper_stereo.hpp"
#include "reconstruction/stereo/stereo.hpp"
#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "reconstruction/stripe/stripe_reconstruction.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

struct PipelineParameters {
  StripeParameters laser;
  PaperStripeParameters laser_paper;
  StereoParameters stereo;
  PaperStereoParameters stereo_paper;
  std::optional<WorkspaceBox> workspace;  ///< in b; points outside are left out of every cloud, and counted
  MetricThresholds thresholds;
};

/// Errors: InputError with file and line. Absent sections keep their defaults.
PipelineParameters pipeline_parameters(const ConfigNode& rig_file);

/// Every key of these sections with its default, range and meaning, as rows of a Markdown table.
std::string pipeline_key_rows();

/// From the session's rig.yaml; defaults for an imported session, which has none.
PipelineParameters pipeline_parameters(const Session& session);

}  // namespace tankrig
