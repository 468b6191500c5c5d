// The rig file's `reconstruction: laser:` and `laser_paper:` sections.

#include <fmt/core.h>

#include "core/settings_table.hpp"
#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_parameters.hpp"

namespace tankrig {
namespace {

using Ours = StripeParameters;
const Setting<Ours> kStripeRows[] = {
    {"orientation", &Ours::orientation, "columns: the stripe crosses them, one point per column; auto: by the image"},
    {"min_snr", &Ours::min_snr, ConfigRange(2, 100),
     "filtered peak over filtered noise at which a column speaks for a stripe"},
    {"max_step_px", &Ours::max_step_px, ConfigRange(0.5, 100),
     "largest move between neighbouring columns of one surface"},
    {"min_run", &Ours::min_run, ConfigRange(1, 10000), "shorter runs of columns are particles"},
    {"max_width_ratio", &Ours::max_width_ratio, ConfigRange(1, 100),
     "widest accepted profile over the image's typical one"},
    {"max_skew", &Ours::max_skew, ConfigRange(0, 100), "largest accepted skewness of a profile"},
    {"max_second_peak", &Ours::max_second_peak, ConfigRange(0, 1),
     "second line over first: above it the column is ambiguous"},
    {"smoothing_px", &Ours::smoothing_px, ConfigRange(0, 50),
     "half window of the local line fit along the stripe; 0: none"},
    {"speckle_floor_px", &Ours::speckle_floor_px, ConfigRange(0, 10), "least sigma, what no smoothing takes away"},
};

using Paper = PaperStripeParameters;
constexpr ConfigRange kHue{0, 179}, kByte{0, 255};

void read_preset(const ConfigNode& node, const char* key, Paper& p) {
  p = node.choice(key, {"real", "simulation"}) == "real" ? Paper::real() : Paper::simulation();
}
const Setting<Paper> kPaperRows[] = {
    {"preset",
     {read_preset, nullptr, "real, simulation"},
     "the values the laboratory published for its camera, or for its simulator; the other keys change them"},
    {"orientation", &Paper::orientation, "as above"},
    {"hue_min", &Paper::hue_min, kHue, "of the gate in OpenCV's 8-bit HSV, both ends included"},
    {"hue_max", &Paper::hue_max, kHue, "likewise"},
    {"saturation_min", &Paper::saturation_min, kByte, "likewise"},
    {"saturation_max", &Paper::saturation_max, kByte, "likewise"},
    {"value_min", &Paper::value_min, kByte, "likewise"},
    {"value_max", &Paper::value_max, kByte, "likewise"},
    {"half_window_px", &Paper::half_window, ConfigRange(0, 100),
     "on either side of the brightest pixel, in the centre of masses"},
    {"blur", &Paper::blur, "Gauss before the gate, as in the laboratory's public code"},
    {"morphology", &Paper::morphology, "open and close the gate, as in the laboratory's public code"},
};

void check_interval(const ConfigNode& node, const std::string& name, int lower, int upper) {
  if (lower > upper) node.fail(name + "_min", fmt::format("found {}, expected at most {}_max, {}", lower, name, upper));
}
void check_gate(const ConfigNode& node, const Paper& p) {
  check_interval(node, "hue", p.hue_min, p.hue_max);
  check_interval(node, "saturation", p.saturation_min, p.saturation_max);
  check_interval(node, "value", p.value_min, p.value_max);
}

}  // namespace

constinit const SettingsTable<StripeParameters> kStripeKeys{kStripeRows};
constinit const SettingsTable<PaperStripeParameters> kPaperStripeKeys{kPaperRows, check_gate};

}  // namespace tankrig
