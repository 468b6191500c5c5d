// `tankrig evaluate`: any cloud against any triangle mesh.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/results/coverage_option.hpp"
#include "apps/tankrig/results/summary.hpp"
#include "apps/tankrig/session/open_session.hpp"
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

struct EvaluateOptions {
  std::filesystem::path cloud, object, pose;
  std::filesystem::path verdict;  ///< coloured cloud to write; empty: none
  std::string definition = "paper";
  std::optional<double> inlier_m, outlier_m, ground_m;
  std::string coverage_mm;   ///< empty: as by default
  std::string ground_plane;  ///< "a,b,c,d" in the object's frame; empty: horizontal, below the mesh
  bool json = false;
};

/// Says why a score is no score of the object.
ExitCode no_score(const PointCloud& cloud, const EvaluateOptions& options) {
  const std::string cloud_file = printable(options.cloud.string());
  if (cloud.points.empty())
    std::fprintf(stderr, "tankrig: %s: empty cloud: %s: nothing to score\n", cloud_file.c_str(),
                 cloud.invalid == 0 ? "it has no point" : "none of its points has three finite coordinates");
  else
    std::fprintf(stderr,
                 "tankrig: %s: no point is near the object: wrong pose, frame or unit? Coordinates are taken as metres "
                 "in frame %s\n",
                 cloud_file.c_str(),
                 cloud.frame.empty() ? "of the pose: the file names none" : shown_text(cloud.frame).c_str());
  return kPartial;
}

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
        !options.ground_plane.empty() || !options.coverage_mm.empty())
      throw InputError(
          "evaluate: --verdict, --inlier, --outlier, --coverage, --ground and --ground-plane belong to --definition "
          "paper");
    const UwsimMetrics metrics = uwsim_metrics(cloud, mesh);
    scored = metrics.inliers > 0;
    result = to_json(metrics);
  } else {
    MetricThresholds thresholds;
    if (options.inlier_m) thresholds.inlier_m = *options.inlier_m;
    if (options.outlier_m) thresholds.outlier_m = *options.outlier_m;
    if (options.ground_m) thresholds.ground_band_m = *options.ground_m;
    set_coverage(thresholds, options.coverage_mm);
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
    if (!options.coverage_mm.empty()) std::printf("%s", coverage_table({{"cloud", result}}).c_str());
  }
  return scored ? kOk : no_score(given, options);
}

}  // namespace

void add_evaluate(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("evaluate", "Score a point cloud against a triangle mesh");
  EvaluateOptions& o = options_of(c, chosen, &evaluate);
  c->footer("Example: tankrig evaluate cloud.ply --object box.obj --pose pose.yaml --json");
  c->add_option("cloud", o.cloud, "Point cloud in metres, .ply or .pcd")->required();
  c->add_option("--object", o.object, "Triangle mesh of the object, in metres")->required();
  c->add_option("--pose", o.pose, "YAML file: translation_m and quaternion_xyzw of the mesh's frame in the cloud's")
      ->required();
  c->add_option("--definition", o.definition,
                "Scores as the paper words them, or as UWSim's benchmark module computes them")
      ->check(CLI::IsMember({"paper", "uwsim"}))
      ->capture_default_str();
  c->add_option("--inlier", o.inlier_m, "Inlier threshold [m] (default 0.010)")->check(CLI::PositiveNumber);
  c->add_option("--outlier", o.outlier_m, "Outlier threshold [m] (default 0.010)")->check(CLI::PositiveNumber);
  add_coverage_option(c, o.coverage_mm);
  c->add_option("--ground", o.ground_m, "Points this near the ground plane [m] may count as ground (default 0.010)")
      ->check(CLI::NonNegativeNumber);
  c->add_option("--ground-plane", o.ground_plane,
                "Ground plane a,b,c,d in the object's frame, in metres (default: level, at the mesh's lowest point)");
  c->add_option("--verdict", o.verdict, "Coloured cloud to write, .ply: ground black, object green, outliers blue");
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
