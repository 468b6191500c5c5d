// A disparity to a few hundredths of a pixel: each window is laid on the slanted plane it sees and fitted by least
// squares.
#pragma once

#include <opencv2/core.hpp>

namespace tankrig {

struct SlantedRefinementParameters {
  int iterations = 8;  ///< at most; a window that has not settled by then has no disparity
  float same_surface_px =
      0.75f;  ///< a neighbour whose coarse disparity is off the window's plane by more does not vote
};

/// All of the size of the left image. NaN where no fit was made or it ran away from the coarse disparity by more than 1
/// px.
struct RefinedDisparity {
  cv::Mat1f disparity;    ///< [px]
  cv::Mat1f sigma;        ///< one standard deviation of `disparity` [px]
  cv::Mat1f correlation;  ///< of the two windows after the fit, gain and offset removed, [-1, 1]
  cv::Mat1f support;      ///< share of the window that voted, [0, 1]
};

/// Fits right(u - d - a (u - u0) - b (v - v0), v) = gain * left(u, v) + offset over the window of every pixel (u0, v0)
/// with a coarse disparity: d, its slopes a and b, gain and offset, by Gauss-Newton with the left image's slopes.
/// `left`, `right`: rectified grey images, smoothed by `smoothing_energy` (sum of the squared weights of that filter);
/// NaN outside. `noise_variance`: of left plus right before smoothing. `coarse`: within 1 px of the truth [px], NaN
/// where unknown. `radius`: of the pixel's window of (2 radius + 1)^2 pixels [px], 0 for none.
/// Source: B. Lucas, T. Kanade 1981 with the affine window of M. Bleyer et al. 2011; S. Baker, I. Matthews 2004 for the
/// constant normal equations.
RefinedDisparity refine_slanted(const cv::Mat1f& left, const cv::Mat1f& right, const cv::Mat1f& coarse,
                                const cv::Mat1b& radius, const cv::Mat1f& noise_variance, double smoothing_energy,
                                const SlantedRefinementParameters& parameters = {});

}  // namespace tankrig
