// `tankrig reconstruct` and `tankrig report`: a recorded session again, without the rig.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/pictures.hpp"
#include "apps/tankrig/scores.hpp"
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
  const Reconstruction reconstruction = reconstruct_session(session, parameters, options.method, progress);
  std::filesystem::path written = options.out;
  if (options.out.empty()) {
    write_clouds(session, reconstruction);
    write_checksums(session.path);
    written = session.path / "clouds" / (options.method + ".ply");
  } else {
    write_cloud(options.out, reconstruction.cloud);
  }
  if (options.json) {
    nlohmann::ordered_json out{{"method", reconstruction.method},     {"points", reconstruction.cloud.points.size()},
                               {"frame", reconstruction.cloud.frame}, {"cloud", written.string()},
                               {"rejected", reconstruction.rejected}, {"rejected_by_reason", reconstruction.rejections},
                               {"seconds", reconstruction.seconds}};
    if (options.out.empty() && !reconstruction.rows.empty())
      out["stripe"] = stripe_file(session, options.method).string();
    if (!reconstruction.reason.empty()) out["reason"] = reconstruction.reason;
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    progress.finish_line();
    std::printf("%zu points in %s (frame %s), %.2f s\n", reconstruction.cloud.points.size(), written.c_str(),
                reconstruction.cloud.frame.c_str(), reconstruction.seconds);
    if (!reconstruction.reason.empty()) std::printf("%s\n", reconstruction.reason.c_str());
  }
  return kOk;
}

int report(const ReportOptions& options) {
  Progress progress;
  const Session session = Session::open(options.session);
  const ReconstructionParameters parameters = reconstruction_parameters(session);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  const std::vector<Score> scores = reconstruct_and_score(session, parameters, object, progress);
  write_pictures_and_report(session, object, scores, nullptr);
  write_checksums(session.path);
  nlohmann::ordered_json out;
  for (const Score& score : scores) out[score.method()] = score.json;
  if (options.json) {
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    progress.finish_line();
    std::printf("%slook at %s\n", score_table(tabled(scores)).c_str(), (session.path / "report.html").c_str());
  }
  return kOk;
}

}  // namespace tankrig::app
