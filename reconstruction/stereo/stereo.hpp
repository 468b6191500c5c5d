// Stereo as we would have it: pairs of the scene at rest averaged over time, matched both ways, fitted on slanted
// windows.
#pragma once

#include <vector>

#include "core/config_node.hpp"
#include "reconstruction/stereo/stereo_pair.hpp"

namespace tankrig {

struct StereoParameters {
  double min_depth_m = 0.5;  ///< along the rectified axis [m]
  double max_depth_m = 2.5;
  int match_window_px = 5;        ///< semi-global matching, odd; noise widens it, to 11 at most
  int uniqueness_percent = 5;     ///< the second best match must cost this much more
  double left_right_px = 1.0;     ///< largest disagreement of the matches seen from either eye
  double texture_to_noise = 2.0;  ///< gradient energy of a window over what the noise alone would give
  double max_sigma_px = 0.25;     ///< of a disparity
  double min_correlation = 0.7;   ///< of the two windows after the fit
  double min_support = 0.6;       ///< share of the window on the same surface
  int window_radius_px = 5;       ///< of the sub-pixel fit; up to three times that where texture is weak
  double edge_jump_px = 2.0;      ///< disparity range within 5 x 5 px that is a depth discontinuity
  int min_region_px = 200;        ///< smaller islands of points are dropped
};

/// The rig file's `reconstruction: stereo:`.
extern const SettingsTable<StereoParameters> kStereoKeys;

/// One cloud of a scene at rest from any number of pairs (the dark blocks of a scan). Every point has a sigma along its
/// viewing ray; its `frame` is the first pair's, its `column` that of the raw left image.
/// Determinism: the same bits whatever the number of threads.
/// Errors: InputError without pairs, or where an image does not fit the calibration.
/// Source: H. Hirschmueller 2008 (semi-global matching, OpenCV), refine_slanted() for the rest.
StereoResult reconstruct(const std::vector<StereoPair>& pairs, const StereoCalibration& calibration,
                         const StereoParameters& parameters = {});

}  // namespace tankrig
