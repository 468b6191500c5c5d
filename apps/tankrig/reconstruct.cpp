// `tankrig reconstruct` and `tankrig report`: a recorded session again, without the rig.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/pictures.hpp"
#include "apps/tankrig/pipeline.hpp"
#include "apps/tankrig/summary.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "rig/session/checksums.hpp"

namespace tankrig::app {

int reconstruct(const ReconstructOptions& options) {
  Progress progress;
  const Session session = Session::open(options.session);
  const ReconstructionParameters parameters = options.rig.empty()
                                                  ? reconstruction_parameters(session)
                                                  : reconstruction_parameters(ConfigNode::load(options.rig));
  const MethodOutcome outcome = reconstruct_session(session, parameters, options.method, progress);
  std::filesystem::path written = options.out;
  if (options.out.empty()) {
    write_clouds(session, outcome);
    write_checksums(session.path);
    written = session.path / "clouds" / (options.method + ".ply");
  } else {
    write_cloud(options.out, outcome.cloud);
  }
  if (options.json) {
    nlohmann::ordered_json out{{"method", outcome.method},     {"points", outcome.cloud.points.size()},
                               {"frame", outcome.cloud.frame}, {"cloud", written.string()},
                               {"rejected", outcome.rejected}, {"rejected_by_reason", outcome.rejections},
                               {"seconds", outcome.seconds}};
    if (!outcome.reason.empty()) out["reason"] = outcome.reason;
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    progress.finish_line();
    std::printf("%zu points in %s (frame %s), %.2f s\n", outcome.cloud.points.size(), written.c_str(),
                outcome.cloud.frame.c_str(), outcome.seconds);
    if (!outcome.reason.empty()) std::printf("%s\n", outcome.reason.c_str());
  }
  return kOk;
}

int report(const ReportOptions& options) {
  Progress progress;
  const Session session = Session::open(options.session);
  const ReconstructionParameters parameters = reconstruction_parameters(session);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  const std::vector<MethodOutcome> outcomes = reconstruct_and_score(session, parameters, object, progress);
  write_pictures_and_report(session, object, outcomes, nullptr);
  write_checksums(session.path);
  nlohmann::ordered_json out;
  std::vector<std::pair<std::string, nlohmann::json>> scores;
  for (const MethodOutcome& outcome : outcomes) {
    out[outcome.method] = outcome.score;
    scores.emplace_back(outcome.method, outcome.score);
  }
  if (options.json) {
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    progress.finish_line();
    std::printf("%slook at %s\n", score_table(scores).c_str(), (session.path / "report.html").c_str());
  }
  return kOk;
}

}  // namespace tankrig::app
