// `tankrig evaluate`: any cloud against any triangle mesh.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/results/coverage_option.hpp"
#include "apps/tankrig/results/peer_definitions.hpp"
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
  std::optional<double> tolerance_m;
  std::vector<double> scanner;  ///< x, y, z in the cloud's frame; empty: none
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

void check_definition(const EvaluateOptions& o) {
  const bool peers = o.definition == "tanks_and_temples" || o.definition == "eth3d";
  const bool papers = !o.verdict.empty() || o.inlier_m || o.outlier_m || !o.coverage_mm.empty();
  const bool ground = o.ground_m || !o.ground_plane.empty();
  if (o.definition == "uwsim" && (papers || ground))
    throw InputError(
        "evaluate: --verdict, --inlier, --outlier, --coverage, --ground and --ground-plane belong to --definition "
        "paper");
  if (peers && papers)
    throw InputError("evaluate: --verdict, --inlier, --outlier and --coverage belong to --definition paper");
  if (!peers && o.tolerance_m)
    throw InputError("evaluate: --tolerance belongs to --definition tanks_and_temples and eth3d");
  if ((o.definition == "eth3d") != !o.scanner.empty())
    throw InputError(o.scanner.empty() ? "evaluate: found no --scanner, expected where ETH3D's laser scanner stands"
                                       : "evaluate: --scanner belongs to --definition eth3d");
}

int evaluate(const EvaluateOptions& options) {
  check_definition(options);
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
  const bool peers = options.definition == "tanks_and_temples" || options.definition == "eth3d";
  if (options.definition == "uwsim") {
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
    if (peers) {
      PeerOptions peer{options.definition == "eth3d", options.tolerance_m.value_or(0.010), std::nullopt};
      if (peer.eth3d)
        peer.scanner = cMo.inverse() * Vector3d(options.scanner[0], options.scanner[1], options.scanner[2]);
      result = peer_scores(cloud, object, thresholds, peer);
      options.json ? print_json(result) : void(std::printf("%s", peer_table(result).c_str()));
      return result.contains("aligned") ? kOk : no_score(given, options);
    }
    const Metrics metrics = tankrig::evaluate(cloud, object, thresholds);
    if (!options.verdict.empty()) write_verdict_cloud(options.verdict, cloud, metrics);
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
                "Scores as the paper words them, as UWSim's benchmark module computes them, or as the benchmarks "
                "Tanks and Temples and ETH3D define them")
      ->check(CLI::IsMember({"paper", "uwsim", "tanks_and_temples", "eth3d"}))
      ->capture_default_str();
  c->add_option("--inlier", o.inlier_m, "Inlier threshold [m] (default 0.010)")->check(CLI::PositiveNumber);
  c->add_option("--outlier", o.outlier_m, "Outlier threshold [m] (default 0.010)")->check(CLI::PositiveNumber);
  add_coverage_option(c, o.coverage_mm);
  c->add_option("--ground", o.ground_m, "Points this near the ground plane [m] may count as ground (default 0.010)")
      ->check(CLI::NonNegativeNumber);
  c->add_option("--ground-plane", o.ground_plane,
                "Ground plane a,b,c,d in the object's frame, in metres (default: level, at the mesh's lowest point)");
  c->add_option("--verdict", o.verdict, "Coloured cloud to write, .ply: ground black, object green, outliers blue");
  c->add_option("--tolerance", o.tolerance_m, "Of Tanks and Temples and of ETH3D [m] (default 0.010)")
      ->check(CLI::PositiveNumber);
  c->add_option("--scanner", o.scanner, "Where ETH3D's laser scanner stands: x,y,z in the cloud's frame [m]")
      ->delimiter(',')
      ->expected(3);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
