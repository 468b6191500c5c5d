#include "apps/tankrig/results/peer_definitions.hpp"

#include <fmt/format.h>

#include "apps/tankrig/results/summary.hpp"
#include "bench/metrics/alignment.hpp"
#include "bench/metrics/peer_scores.hpp"

using nlohmann::json;

namespace tankrig::app {
namespace {

json number_or_null(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

json peer_score_of(const std::vector<Vector3d>& points, const ObjectSurface& object, const PeerOptions& options,
                   const std::optional<TruthScan>& scan) {
  if (scan) {
    const Eth3dScore s = eth3d_score(points, {*scan}, options.tolerance_m);
    return {{"definition", "eth3d"},
            {"tolerance_m", s.tolerance_m},
            {"accuracy", number_or_null(s.accuracy)},
            {"completeness", s.completeness},
            {"f1", s.f1},
            {"points", points.size()},
            {"accurate", s.accurate},
            {"inaccurate", s.inaccurate},
            {"unobserved", s.unobserved},
            {"scan_points", scan->points.size()}};
  }
  std::vector<Vector3d> surface;
  for (const SurfaceSample& sample : object.samples()) surface.push_back(sample.p);
  const TanksAndTemplesScore s = tanks_and_temples_score(points, surface, options.tolerance_m);
  return {{"definition", "tanks_and_temples"},
          {"tolerance_m", s.tau_m},
          {"precision", number_or_null(s.precision)},
          {"recall", s.recall},
          {"f", s.f},
          {"points", s.points},
          {"truth_points", s.truth_points}};
}

std::string peer_row(const char* name, const json& score) {
  const auto percent = [&](const char* key) {
    return score.at(key).is_number() ? fmt::format("{:.2f} %", 100 * score.at(key).get<double>()) : "none";
  };
  const bool eth3d = score.at("definition") == "eth3d";
  return fmt::format("{:<13}  {:>9}  {:>9}  {:>12}  {:>9}\n", name, score.at("points").get<std::size_t>(),
                     percent(eth3d ? "accuracy" : "precision"), percent(eth3d ? "completeness" : "recall"),
                     percent(eth3d ? "f1" : "f"));
}

}  // namespace

json peer_scores(const PointCloud& cloud, const ObjectSurface& object, const MetricThresholds& thresholds,
                 const PeerOptions& options) {
  const Metrics metrics = evaluate(cloud, object, thresholds);
  const std::vector<Vector3d> points = above_ground(cloud, metrics);
  std::optional<TruthScan> scan;
  if (options.eth3d) scan = scan_of(object, options.scanner.value());
  json result = peer_score_of(points, object, options, scan);
  if (metrics.object_points == 0) return result;
  const AlignedScore aligned = evaluate_aligned(cloud, object, thresholds, metrics);
  if (aligned.metrics) {
    std::vector<Vector3d> moved;
    for (const Vector3d& p : points) moved.push_back(aligned.registration.aMb * p);
    result["aligned"] = peer_score_of(moved, object, options, scan);
  } else {
    result["aligned"]["refused"] = aligned.doubt;
  }
  result["aligned"]["transform"] = to_json(aligned.registration);
  return result;
}

std::string peer_table(const json& score) {
  const bool eth3d = score.at("definition") == "eth3d";
  std::string text =
      fmt::format("{:<13}  {:>9}  {:>9}  {:>12}  {:>9}\n", "", "points", eth3d ? "accuracy" : "precision",
                  eth3d ? "completeness" : "recall", eth3d ? "F1" : "F") +
      peer_row("cloud", score);
  if (score.contains("aligned")) {
    const json& aligned = score.at("aligned");
    text += aligned.contains("refused")
                ? "not aligned: " + aligned.at("refused").get<std::string>() + "\n"
                : peer_row("cloud aligned", aligned) + "aligned: " + registration_line(aligned.at("transform")) + "\n";
  }
  return text + fmt::format("tolerance {:g} mm\n", 1e3 * score.at("tolerance_m").get<double>());
}

}  // namespace tankrig::app
