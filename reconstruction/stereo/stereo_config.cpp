// The rig file's `reconstruction: stereo:` and `stereo_paper:` sections.
#include "core/settings_table.hpp"
#include "reconstruction/stereo/paper_stereo.hpp"
#include "reconstruction/stereo/stereo.hpp"

namespace tankrig {
namespace {

void check_odd(const ConfigNode& node, const char* key, int value) {
  if (value % 2 == 0) node.fail(key, "found " + std::to_string(value) + ", expected an odd number");
}

using Ours = StereoParameters;
const Setting<Ours> kStereoRows[] = {
    {"min_depth_m", &Ours::min_depth_m, ConfigRange(0.05, 20), "along the rectified axis"},
    {"max_depth_m", &Ours::max_depth_m, ConfigRange(0.05, 100), "likewise"},
    {"match_window_px", &Ours::match_window_px, ConfigRange(1, 21),
     "semi-global matching, odd; noise widens it, to 11 at most"},
    {"uniqueness_percent", &Ours::uniqueness_percent, ConfigRange(0, 100),
     "the second best match must cost this much more"},
    {"left_right_px", &Ours::left_right_px, ConfigRange(0, 10),
     "largest disagreement of the matches seen from either eye"},
    {"texture_to_noise", &Ours::texture_to_noise, ConfigRange(1, 1000),
     "gradient energy of a window over what the noise alone would give"},
    {"max_sigma_px", &Ours::max_sigma_px, ConfigRange(0.001, 10), "of a disparity"},
    {"min_correlation", &Ours::min_correlation, ConfigRange(0, 1), "of the two windows after the fit"},
    {"min_support", &Ours::min_support, ConfigRange(0, 1), "share of the window on the same surface"},
    {"window_radius_px", &Ours::window_radius_px, ConfigRange(2, 15),
     "of the sub-pixel fit; up to three times that where texture is weak"},
    {"edge_jump_px", &Ours::edge_jump_px, ConfigRange(0.1, 100),
     "disparity range within 5 x 5 px that is a depth discontinuity"},
    {"min_region_px", &Ours::min_region_px, ConfigRange(0, 100000), "smaller islands of points are dropped"},
};
void check_stereo(const ConfigNode& node, const Ours& p) {
  if (p.max_depth_m <= p.min_depth_m) node.fail("max_depth_m", "expected more than min_depth_m");
  check_odd(node, "match_window_px", p.match_window_px);
}

using Paper = PaperStereoParameters;
const Setting<Paper> kPaperStereoRows[] = {
    {"prefilter_size", &Paper::prefilter_size, ConfigRange(5, 255),
     "[px], odd; names and defaults are ROS stereo_image_proc's"},
    {"prefilter_cap", &Paper::prefilter_cap, ConfigRange(1, 63), "[grey levels]"},
    {"correlation_window_size", &Paper::correlation_window_size, ConfigRange(5, 255), "[px], odd"},
    {"min_disparity", &Paper::min_disparity, ConfigRange(-128, 128), "[px]"},
    {"disparity_range", &Paper::disparity_range, ConfigRange(16, 256),
     "[px], a multiple of 16; the authors' launch file's"},
    {"uniqueness_ratio", &Paper::uniqueness_ratio, ConfigRange(0, 100), "[%]"},
    {"texture_threshold", &Paper::texture_threshold, ConfigRange(0, 10000),
     "sum of prefiltered gradients in the window"},
    {"speckle_size", &Paper::speckle_size, ConfigRange(0, 1000), "[px]"},
    {"speckle_range", &Paper::speckle_range, ConfigRange(0, 31), "[px]"},
};
void check_paper_stereo(const ConfigNode& node, const Paper& p) {
  check_odd(node, "prefilter_size", p.prefilter_size);
  check_odd(node, "correlation_window_size", p.correlation_window_size);
  if (p.disparity_range % 16 != 0)
    node.fail("disparity_range", "found " + std::to_string(p.disparity_range) + ", expected a multiple of 16");
}

}  // namespace

constinit const SettingsTable<StereoParameters> kStereoKeys{kStereoRows, check_stereo};
constinit const SettingsTable<PaperStereoParameters> kPaperStereoKeys{kPaperStereoRows, check_paper_stereo};

}  // namespace tankrig
