// One frame of a preview: how sharp, how exposed, where the stripe is - measured, and drawn for people.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// What is drawn on a frame and below it.
struct PreviewMarks {
  double focus = 0;              ///< focus_of() this frame
  double best_focus = 0;         ///< largest so far
  bool laser = false;            ///< the laser is on: the stripe has been looked for
  std::vector<Vector2d> stripe;  ///< column, row [px], centre of the top-left pixel at 0
  std::string caption;           ///< one line: camera, frame rate, lost frames
};

/// Variance of the Laplacian of the slightly smoothed brightness [grey levels squared]: it grows as edges get sharper.
/// Only pictures of one scene in one light compare.  `frame`: 8-bit, 1 or 3 (BGR) channels, as everywhere here.
double focus_of(const cv::Mat& frame);

/// 255 where any channel is at full scale, else 0: brighter than the camera can tell.
cv::Mat1b clipped_mask(const cv::Mat& frame);

/// Number of pixels per value; one histogram per channel.
std::vector<std::array<int, 256>> histograms_of(const cv::Mat& frame);

/// The laser stripe by the detector the reconstruction uses [px]. `background`: the same view with the laser off, or
/// empty.
std::vector<Vector2d> stripe_points(const cv::Mat& frame, const cv::Mat& background);

/// The frame with clipped pixels magenta and a dot at every stripe point, enlarged by a whole number if it is narrow,
/// and below it caption, focus bar, clipped share, stripe points and histogram.  8-bit BGR.
cv::Mat preview_picture(const cv::Mat& frame, const PreviewMarks& marks);

}  // namespace tankrig
