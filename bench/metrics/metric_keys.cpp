// The rig file's `evaluation` section.
#include "bench/metrics/metrics.hpp"
#include "core/settings_table.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kThreshold{1e-6, 10};

using Thresholds = MetricThresholds;
const Setting<Thresholds> kMetricRows[] = {
    {"inlier_m", &Thresholds::inlier_m, kThreshold,
     "points this near to the surface are the object's: they carry the error figures"},
    {"outlier_m", &Thresholds::outlier_m, kThreshold, "points farther than this are outliers; at least inlier_m"},
    {"coverage_m", &Thresholds::coverage_m, kThreshold,
     "surface nearer than this to one of the object's points is covered"},
    {"coverage_headline_m", &Thresholds::coverage_headline_m, kThreshold, "the one quoted alone"},
    {"ground_band_m", &Thresholds::ground_band_m, ConfigRange(0, 10), "how far from the ground a ground point may be"},
    {"max_incidence_deg", &Thresholds::max_incidence, ConfigRange(0, 90), "of the ceiling"},
    {"surface_samples", &Thresholds::surface_samples, ConfigRange(1000, 1e7), "patches of the surface, about"},
};
void check_thresholds(const ConfigNode& node, const Thresholds& t) {
  if (t.outlier_m < t.inlier_m)
    node.fail("outlier_m",
              "found " + exact_text(t.outlier_m) + ", expected at least inlier_m, " + exact_text(t.inlier_m));
}

}  // namespace

constinit const SettingsTable<MetricThresholds> kMetricKeys{kMetricRows, check_thresholds};

}  // namespace tankrig
