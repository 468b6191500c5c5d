#include "bench/report/figures.hpp"

#include <fmt/core.h>

#include <cmath>
#include <map>
#include <set>

namespace tankrig {
namespace {

const std::set<std::string> kShares{"coverage", "coverage_ceiling", "coverage_ceiling_sigma", "coverage_of_ceiling",
                                    "outliers", "rejected"};

}  // namespace

std::string millimetres(double metres) {
  const double mm = metres * 1e3;
  return std::abs(mm - std::round(mm)) < 1e-9 ? fmt::format("{:.0f} mm", mm) : fmt::format("{:.3f} mm", mm);
}

std::string percent(double share) {
  return fmt::format("{:.{}f} %", share * 100, std::abs(share) < 0.01 && share != 0 ? 2 : 1);
}

std::string figure_name(const std::string& key) {
  static const std::map<std::string, std::string> names{
      {"mean_error_m", "mean error"},
      {"mean_error_sigma_m", "standard error of the mean"},
      {"stddev_m", "standard deviation"},
      {"median_m", "median"},
      {"rms_m", "root mean square"},
      {"p95_m", "95th percentile"},
      {"bias_m", "signed bias (positive outside)"},
      {"coverage", "coverage of the whole surface"},
      {"coverage_ceiling", "ceiling: surface that could be seen"},
      {"coverage_ceiling_sigma", "ceiling, sampling error"},
      {"coverage_of_ceiling", "coverage of the ceiling"},
      {"outliers", "outliers among non-ground points"},
      {"rejected", "points not on the object: ground and outliers"},
      {"inlier_m", "an object's point: nearer than"},
      {"outlier_m", "outlier: farther than"},
      {"coverage_m", "coverage at each of"},
      {"coverage_headline_m", "coverage that is quoted: within"},
      {"ground_band_m", "ground point: within, of the ground"},
      {"ground_plane", "ground, a plane in the object's frame"},
      {"max_incidence_deg", "ceiling: seen and lit less steeply than"},
      {"surface_samples", "patches of the surface, about"},
      {"surface_area_m2", "object's surface"}};
  if (const auto found = names.find(key); found != names.end()) return found->second;
  std::string out = key;
  for (char& c : out)
    if (c == '_') c = ' ';
  return out;
}

std::string shown_figure(const nlohmann::json& metrics, const std::string& key) {
  const auto found = metrics.find(key);
  if (found == metrics.end() || found->is_null()) return "none";
  if (found->is_string()) return found->get<std::string>();
  if (found->is_array() && key.ends_with("_m")) {
    std::string list;
    for (const auto& metres : *found) list += (list.empty() ? "" : ", ") + millimetres(metres.get<double>());
    return list;
  }
  if (!found->is_number()) return found->dump();
  if (found->is_number_integer()) return found->dump();
  const double value = found->get<double>();
  if (kShares.contains(key)) return percent(value);
  if (key.ends_with("_m2")) return fmt::format("{:.5g} m²", value);
  if (key.ends_with("_m")) return fmt::format("{:.3f} mm", value * 1e3);
  if (key.ends_with("_deg")) return fmt::format("{:.6g}°", value);
  return fmt::format("{:.6g}", value);
}

}  // namespace tankrig
