// `tankrig evaluate`: any cloud against any triangle mesh.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/open_session.hpp"
#include "apps/tankrig/output.hpp"
#include "apps/tankrig/summary.hpp"
#include "bench/metrics/alignment.hpp"
#include "bench/metrics/metrics_json.hpp"
#include "bench/metrics/verdict_cloud.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "session/import/planes_csv.hpp"

namespace tankrig::app {
namespace {

/// Says why a score is no score of the object.
ExitCode no_score(const PointCloud& cloud, const EvaluateOptions& options) {
  const std::string cloud_file = printable(options.cloud.string());
  if (cloud.points.empty())
    std::fprintf(stderr, "tankrig: %s: the cloud has no point: nothing to score\n", cloud_file.c_str());
  else
    std::fprintf(stderr,
                 "tankrig: %s: no point is near the object: wrong pose, frame or unit? Coordinates are taken as metres "
                 "in frame %s\n",
                 cloud_file.c_str(),
                 cloud.frame.empty() ? "of the pose: the file names none" : shown_text(cloud.frame).c_str());
  return kPartial;
}

}  // namespace

int evaluate(const EvaluateOptions& options) {
  if (!options.verdict.empty() && options.verdict.extension() != ".ply")
    throw InputError(options.verdict, "found extension '" + options.verdict.extension().string() + "', expected .ply");
  if (!options.verdict.empty()) check_in_no_session(options.verdict);
  std::error_code ignored;
  if (std::filesystem::equivalent(options.verdict, options.cloud, ignored))
    throw InputError(options.verdict, "is the cloud itself, expected another file for --verdict");
  const ConfigNode pose = ConfigNode::load(options.pose);
  const Transform cMo = pose.as_transform();
  pose.finish();
  const PointCloud given = read_cloud(options.cloud);
  const PointCloud cloud = transformed(cMo.inverse(), given, "o");
  TriangleMesh mesh = read_mesh(options.object);

  nlohmann::json result;
  bool scored = false;
  if (options.definition == "uwsim") {
    if (!options.verdict.empty() || options.inlier_m || options.outlier_m || options.ground_m ||
        !options.ground_plane.empty())
      throw InputError(
          "evaluate: --verdict, --inlier, --outlier, --ground and --ground-plane belong to --definition paper");
    const UwsimMetrics metrics = uwsim_metrics(cloud, mesh);
    scored = metrics.inliers > 0;
    result = to_json(metrics);
  } else {
    MetricThresholds thresholds;
    if (options.inlier_m) thresholds.inlier_m = *options.inlier_m;
    if (options.outlier_m) thresholds.outlier_m = *options.outlier_m;
    if (options.ground_m) thresholds.ground_band_m = *options.ground_m;
    if (!options.ground_plane.empty()) thresholds.ground = parse_plane(options.ground_plane);
    const ObjectSurface object(std::move(mesh), thresholds.surface_samples);
    const Metrics metrics = tankrig::evaluate(cloud, object, thresholds);
    if (!options.verdict.empty()) write_verdict_cloud(options.verdict, cloud, metrics.verdicts);
    result = to_json(metrics);
    scored = metrics.object_points > 0;
    if (scored) result["aligned"] = to_json(evaluate_aligned(cloud, object, thresholds, metrics));
  }
  if (options.json) {
    print_json(result);
  } else if (options.definition == "uwsim") {
    std::printf("%s", uwsim_table(result).c_str());
  } else {
    std::printf("%s", aligned_table(result).c_str());
  }
  return scored ? kOk : no_score(given, options);
}

}  // namespace tankrig::app
