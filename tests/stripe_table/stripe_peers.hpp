// Published ways to find a stripe, from OpenCV's building blocks, for the table of detectors. Each is given what it
// lacks: the dark frame subtracted, or the laser's channel less the mean of the others.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

/// The light a peer searches: grey, float. `channel`: the laser's (0 B, 1 G, 2 R), as an expert would tell it.
cv::Mat1f peer_light(const cv::Mat& image, const cv::Mat& background, int channel);

/// A row per column, NaN where nothing is found: below `threshold` [DN] nothing is searched.
std::vector<double> steger_ridge(const cv::Mat1f& light, double sigma, double threshold);  ///< Steger 1998
std::vector<double> log_parabola(const cv::Mat1f& light, double threshold);
std::vector<double> centre_of_mass(const cv::Mat1f& light, int half_window, double threshold);

}  // namespace tankrig
