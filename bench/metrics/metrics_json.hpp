// Scores as JSON, for result files and --json.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "bench/metrics/metrics.hpp"
#include "bench/metrics/uwsim_metrics.hpp"

namespace tankrig {

/// points, mean_error_m, stddev_m, median_m, rms_m, p95_m, bias_m, mean_error_sigma_m, coverage (at the headline
/// threshold), coverage_at {"0.002": ...}, coverage_sigma_at, coverage_ceiling, coverage_ceiling_sigma,
/// coverage_of_ceiling, coverage_of_ceiling_at, coverage_of_ceiling_sigma_at, outliers (share), outlier_count,
/// ground_points, object_points, invalid_points, rejected, surface_area_m2, surface_samples, thresholds {...},
/// definition "paper". Shares are 0..1; what is not defined is null.
nlohmann::json to_json(const Metrics& metrics);

/// The reference module's figures, its hard-coded thresholds and its oddities; definition "uwsim".
nlohmann::json to_json(const UwsimMetrics& metrics);

}  // namespace tankrig
