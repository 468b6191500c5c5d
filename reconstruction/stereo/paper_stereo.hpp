// The paper's stereo chain, unmodified: rectify, OpenCV block matching, a dense cloud of one pair.
#pragma once

#include "core/config_node.hpp"
#include "reconstruction/stereo/stereo_pair.hpp"

namespace tankrig {

/// ROS stereo_image_proc's parameters by its names and with its defaults, but for disparity_range, where the
/// authors' launch file of their stereo camera sets 128.
struct PaperStereoParameters {
  int prefilter_size = 9;            ///< [px], odd, 5..255
  int prefilter_cap = 31;            ///< [grey levels], 1..63
  int correlation_window_size = 15;  ///< [px], odd, 5..255
  int min_disparity = 0;             ///< [px]
  int disparity_range = 128;         ///< [px], multiple of 16
  int uniqueness_ratio = 15;         ///< [%]
  int texture_threshold = 10;        ///< sum of prefiltered gradients in the window
  int speckle_size = 100;            ///< [px]
  int speckle_range = 4;             ///< [px]
};

/// The rig file's `reconstruction: stereo_paper:`.
extern const SettingsTable<PaperStereoParameters> kPaperStereoKeys;

/// Every pixel with a valid positive disparity becomes a point; sigma stays 0 (the method has none).
/// Errors: InputError on images that do not fit the calibration.
/// Source: K. Konolige 1997 as in cv::StereoBM.
StereoResult reconstruct_paper(const StereoPair& pair, const StereoCalibration& calibration,
                               const PaperStereoParameters& parameters = {});

}  // namespace tankrig
