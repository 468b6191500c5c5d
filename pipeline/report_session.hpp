// The pictures of a session and its report.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/score_session.hpp"

namespace tankrig {

/// The rig from outside, with the arm at `q`: BGR. Empty if it cannot be drawn: an existing picture is kept.
using OutsideView = std::function<cv::Mat(const JointVector& q, bool laser_on)>;

/// PNGs of a report by their names without ".png".
using Pictures = std::map<std::string, std::string>;

/// Those of one method.
Pictures draw_pictures(const Session& session, const ObjectSurface& object, const Score& score);

/// What was made of this session before, and need not be made again.
struct ReadyReport {
  std::vector<Score> scores;
  Pictures pictures;
};

/// Writes pictures/*.png and report.html into the session.
void write_pictures_and_report(const Session& session, const ObjectSurface& object, const std::vector<Score>& scores,
                               const OutsideView& outside = {}, const Pictures& ready = {});

/// Clouds, scores, pictures, report.html and SHA256SUMS. Nothing if `stop` was set meanwhile: then there is no report,
/// and the check sums cover what exists.
std::optional<std::vector<Score>> reconstruct_and_report(const Session& session, const PipelineParameters& parameters,
                                                         const std::atomic<bool>& stop,
                                                         const ProgressCallback& progress = {},
                                                         const OutsideView& outside = {}, ReadyReport ready = {});

}  // namespace tankrig
