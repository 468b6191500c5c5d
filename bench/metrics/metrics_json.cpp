#include "bench/metrics/metrics_json.hpp"

#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace tankrig {
namespace {

using nlohmann::json;

json or_null(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

json finite_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

/// "0.002": metres with three decimals, or as many as a finer threshold needs.
std::string threshold_key(double metres) {
  const bool whole_mm = std::abs(metres * 1e3 - std::round(metres * 1e3)) < 1e-9;
  return whole_mm ? fmt::format("{:.3f}", metres) : fmt::format("{:.9g}", metres);
}

json thresholds_json(const MetricThresholds& t) {
  json j{{"inlier_m", t.inlier_m},
         {"outlier_m", t.outlier_m},
         {"coverage_m", t.coverage_m},
         {"coverage_headline_m", t.coverage_headline_m},
         {"ground_band_m", t.ground_band_m},
         {"max_incidence_deg", std::round(t.max_incidence * 180.0 / std::numbers::pi * 1e9) / 1e9},
         {"surface_samples", t.surface_samples}};
  if (t.ground)
    j["ground_plane"] = {t.ground->normal.x(), t.ground->normal.y(), t.ground->normal.z(), t.ground->offset};
  return j;
}

}  // namespace

json to_json(const Metrics& m) {
  json j{{"definition", "paper"},
         {"points", m.points},
         {"ground_points", m.ground_points},
         {"object_points", m.object_points},
         {"outlier_count", m.outlier_count},
         {"invalid_points", m.invalid_points},
         {"outliers", or_null(m.outliers)},
         {"rejected", or_null(m.rejected)},
         {"surface_area_m2", m.surface_area},
         {"surface_samples", m.samples},
         {"coverage", m.headline().whole},
         {"coverage_of_ceiling", or_null(m.headline().of_ceiling)},
         {"coverage_ceiling", or_null(m.coverage_ceiling)},
         {"coverage_ceiling_sigma", or_null(m.coverage_ceiling_sigma)},
         {"thresholds", thresholds_json(m.thresholds)}};
  const ErrorFigures* e = m.error ? &*m.error : nullptr;
  j["mean_error_m"] = e ? json(e->mean) : json(nullptr);
  j["mean_error_sigma_m"] = e ? or_null(e->mean_sigma) : json(nullptr);
  j["stddev_m"] = e ? or_null(e->stddev) : json(nullptr);
  j["median_m"] = e ? json(e->median) : json(nullptr);
  j["rms_m"] = e ? json(e->rms) : json(nullptr);
  j["p95_m"] = e ? json(e->p95) : json(nullptr);
  j["bias_m"] = e ? or_null(e->bias) : json(nullptr);
  for (const Coverage& c : m.coverage) {
    const std::string key = threshold_key(c.threshold_m);
    j["coverage_at"][key] = c.whole;
    j["coverage_sigma_at"][key] = c.whole_sigma;
    j["coverage_of_ceiling_at"][key] = or_null(c.of_ceiling);
    j["coverage_of_ceiling_sigma_at"][key] = or_null(c.of_ceiling_sigma);
  }
  return j;
}

json to_json(const UwsimMetrics& m) {
  return {
      {"definition", "uwsim"},
      {"points", m.points},
      {"ground_points", m.ground_points},
      {"inliers", m.inliers},
      {"outlier_count", m.outlier_count},
      {"outliers", m.outliers},
      {"mean_error_m", m.mean_error_m},
      {"error_variance_m2", finite_or_null(m.error_variance_m2)},
      {"coverage", m.coverage},
      {"lattice", {{"nodes", m.lattice}, {"marked", m.marked_nodes}, {"denominator", m.denominator}}},
      {"thresholds",
       {{"outlier_m", kUwsimOutlier}, {"ground_band_m", kUwsimGroundBand}, {"level_of_detail_m", m.level_of_detail_m}}},
      {"oddities", uwsim_oddities()}};
}

}  // namespace tankrig
