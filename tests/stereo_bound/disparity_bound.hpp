// How exactly anybody can know a surface from a stereo pair of it, given its texture, the noise and the number of pairs: the
// Cramer-Rao bound of a window's disparity, in millimetres of the surface.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "bench/metrics/metrics.hpp"

namespace tankrig::testing {

/// Fisher information about the mean of a Gaussian variable that is read as 0 wherever it is below, as a share of what the
/// whole variable would give. `z`: the mean over the standard deviation.
/// Source: T. Amemiya 1973.
double censored_information(double z);

/// Two eyes side by side without distortion: what has depth z in the left one is focal_px * baseline / z to the left in the
/// right one.
struct Eyes {
  CameraView left, right;  ///< as of the object's frame o
  double focal_px = 0, baseline = 0;
};

/// What the left eye sees of the object without noise, in the full light, and how certain each pixel can be.
///
/// Every pixel of the window that lies on the same flat face counts, of every channel, by its gradient along the row and its
/// noise: var(d) = 1 / sum(g^2 / (2 var / pairs)), doubled because both eyes are noisy and nobody knows the texture
/// (D. Robinson, P. Milanfar 2004). The rest is known: slope of the face, gain and offset of the eyes, the match to the pixel.
/// So no unbiased estimate from such a window is better.
class DisparityBound {
 public:
  /// `clean`: BGR, 8 bits, without noise or particles.
  DisparityBound(const cv::Mat3b& clean, const Eyes& eyes, const ObjectSurface& object,
                 const MetricThresholds& thresholds);

  struct Condition {
    double light = 1;        ///< share of the light of the clean picture
    double noise = 0;        ///< standard deviation of a channel of one picture [grey levels]
    int pairs = 1;           ///< averaged
    int radius_px = 15;      ///< of the window
    double spread_m = 0.01;  ///< a point this near to a place of the surface covers it
  };
  /// Mean distance from the surface [m], Gaussian, of points that cover this share of what both eyes see, evenly: of the
  /// places where it can be least.
  double mean_error(const Condition& condition, double share) const;

  /// Share of the surface that both eyes see.
  const Ceiling& ceiling() const { return ceiling_; }

 private:
  /// Of the pixel whose window this is [m]; large where there is no object.
  cv::Mat1f errors(const Condition& condition) const;

  Eyes eyes_;
  const ObjectSurface& object_;
  Ceiling ceiling_;
  cv::Mat3f grey_, slope_;  ///< along the row [grey levels per px]
  cv::Mat1i face_;          ///< -1: not the object
  cv::Mat1f metres_;        ///< from the surface, for a pixel of disparity
  int faces_ = 0;
};

}  // namespace tankrig::testing
