// `tankrig reconstruct` and `tankrig report`: a recorded session again, without the rig.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/output.hpp"
#include "apps/tankrig/pictures.hpp"
#include "apps/tankrig/rig_files.hpp"
#include "apps/tankrig/scores.hpp"
#include "apps/tankrig/stop.hpp"
#include "apps/tankrig/summary.hpp"
#include "core/input_error.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/session/checksums.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Opens a session and says what is wrong with it: cut tables, an edited calibration, files that are not as they were
/// sealed.
Session open_session(const fs::path& path, Progress& progress) {
  Session session = Session::open(path);
  if (fs::exists(path / "SHA256SUMS"))
    for (const std::string& difference : check_checksums(path))
      session.warnings.push_back(difference + " since the session was sealed");
  for (const std::string& warning : session.warnings) progress.warn(warning);
  if (session.info.status != "complete") progress.warn(path.string() + ": " + session.info.status);
  return session;
}

void check_extension(const fs::path& out) {
  if (!out.empty() && out.extension() != ".ply" && out.extension() != ".pcd")
    throw InputError(out, "found extension '" + out.extension().string() + "', expected .ply or .pcd");
}

}  // namespace

int reconstruct(const ReconstructOptions& options) {
  check_extension(options.out);
  Progress progress;
  const Session session = open_session(options.session, progress);
  const ReconstructionParameters parameters = options.rig.empty()
                                                  ? reconstruction_parameters(session)
                                                  : reconstruction_parameters(rig_file(find_rig(options.rig.string())));
  const Reconstruction reconstruction = reconstruct_session(session, parameters, options.method, progress);
  const bool laser = options.method.starts_with("laser");
  fs::path written = options.out, stripe = stripe_file(session, options.method);
  if (options.out.empty()) {
    write_clouds(session, reconstruction);
    if (session.info.status != "recording") write_checksums(session.path);
    written = session.path / "clouds" / (options.method + ".ply");
  } else {
    write_cloud(options.out, reconstruction.cloud);
    if (laser) {
      stripe = fs::path(options.out).replace_filename(options.out.stem().string() + "_stripe.csv");
      write_stripe_csv(stripe, reconstruction.rows, reconstruction.orientation);
    }
  }
  progress.finish_line();
  if (options.json) {
    nlohmann::ordered_json out{{"method", reconstruction.method},     {"points", reconstruction.cloud.points.size()},
                               {"frame", reconstruction.cloud.frame}, {"cloud", written.string()},
                               {"rejected", reconstruction.rejected}, {"rejected_by_reason", reconstruction.rejections},
                               {"seconds", reconstruction.seconds},   {"warnings", session.warnings}};
    if (laser) out["stripe"] = stripe.string();
    if (!reconstruction.reason.empty()) out["reason"] = reconstruction.reason;
    print_json(out);
  } else {
    std::printf("%zu points in %s (frame %s), %.2f s\n", reconstruction.cloud.points.size(), written.c_str(),
                reconstruction.cloud.frame.c_str(), reconstruction.seconds);
    if (!reconstruction.reason.empty()) std::printf("%s\n", reconstruction.reason.c_str());
  }
  return kOk;
}

int report(const ReportOptions& options) {
  Progress progress;
  const Session session = open_session(options.session, progress);
  const ReconstructionParameters parameters = reconstruction_parameters(session);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  const StopOnSignal stop_on_signal;
  const std::vector<Score> scores =
      reconstruct_and_score(session, parameters, object, StopOnSignal::requested(), progress);
  if (!StopOnSignal::requested()) write_pictures_and_report(session, object, scores, nullptr);
  write_checksums(session.path);
  progress.finish_line();
  if (StopOnSignal::requested()) {
    progress.warn("stopped before the report");
    return kPartial;
  }
  if (options.json)
    print_json(scores_json(scores));
  else
    std::printf("%slook at %s\n", score_table(tabled(scores)).c_str(), (session.path / "report.html").c_str());
  return kOk;
}

}  // namespace tankrig::app
