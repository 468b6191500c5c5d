// `tankrig reconstruct`: a recorded session again, without the rig.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/results/summary.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "pipeline/score_session.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "rig/config/rig_config.hpp"
#include "session/checking/checksums.hpp"
#include "session/recording/session_lock.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct ReconstructOptions {
  std::filesystem::path session;
  std::string method = "laser";
  std::filesystem::path rig;  ///< reconstruction parameters; empty: the session's own
  std::filesystem::path out;  ///< empty: SESSION/clouds/METHOD.ply
  bool json = false;
};

void check_extension(const fs::path& out) {
  if (!out.empty() && out.extension() != ".ply" && out.extension() != ".pcd")
    throw InputError(out, "found extension '" + out.extension().string() + "', expected .ply or .pcd");
}

int reconstruct(const ReconstructOptions& options) {
  check_extension(options.out);
  if (!options.out.empty()) check_in_no_session(options.out);
  Progress progress;
  const SessionLock at_rest(options.session, options.out.empty() ? SessionUse::kWrite : SessionUse::kRead);
  const Session session = open_with_warnings(options.session, progress).session;
  const PipelineParameters parameters = options.rig.empty()
                                            ? pipeline_parameters(session)
                                            : pipeline_parameters(rig_file(find_rig(options.rig.string())));
  const Reconstruction reconstruction = reconstruct_session(session, parameters, options.method, progress.callback());
  const bool laser = by_laser(options.method);
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
  if (!reconstruction.warning.empty()) progress.warn(reconstruction.warning);
  if (options.json) {
    nlohmann::ordered_json out{{"method", reconstruction.method},     {"points", reconstruction.cloud.points.size()},
                               {"frame", reconstruction.cloud.frame}, {"cloud", written.string()},
                               {"rejected", reconstruction.rejected}, {"rejected_by_reason", reconstruction.rejections},
                               {"seconds", reconstruction.seconds},   {"warnings", session.warnings}};
    if (laser) {
      out["stripe"] = stripe.string();
      out["orientation"] = to_string(reconstruction.orientation);
      out["orientation_share"] = reconstruction.orientation_share;
    }
    if (!reconstruction.warning.empty()) out["warning"] = reconstruction.warning;
    if (!reconstruction.reason.empty()) out["reason"] = reconstruction.reason;
    print_json(out);
  } else {
    std::printf("%zu points in %s (frame %s), %.2f s\n", reconstruction.cloud.points.size(),
                printable(written.string()).c_str(), reconstruction.cloud.frame.c_str(), reconstruction.seconds);
    if (!reconstruction.reason.empty()) std::printf("%s\n", reconstruction.reason.c_str());
  }
  return kOk;
}

}  // namespace

void add_reconstruct(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("reconstruct", "Reconstruct a point cloud from a session");
  ReconstructOptions& o = options_of(c, chosen, &reconstruct);
  c->footer("Example: tankrig reconstruct sessions/monday --method laser --json");
  add_session_option(c, o.session);
  c->add_option("--method", o.method, "Reconstruction method")
      ->check(CLI::IsMember(tankrig::kMethods))
      ->capture_default_str();
  c->add_option("--rig", o.rig, "Rig whose reconstruction parameters replace the session's");
  c->add_option("--out", o.out, "Cloud file to write, .ply or .pcd (default: both, in SESSION/clouds)");
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
