// OpenCV's semi-global matcher, run on the pair and on its mirror image.
#include "reconstruction/stereo/coarse_match.hpp"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace tankrig {
namespace {

/// From grey to 8 bits: (grey - low) * gain.
struct Stretch {
  float low, gain;
};

/// Takes 0.5 % of the grey levels of both images to 0 and 99.5 % to 255.
Stretch stretch(const cv::Mat1f& left, const cv::Mat1f& right) {
  std::vector<float> values;
  values.reserve(left.total() + right.total());
  for (const cv::Mat1f* image : {&left, &right})
    std::copy_if(image->begin(), image->end(), std::back_inserter(values), [](float g) { return !std::isnan(g); });
  if (values.empty()) return {0, 1};
  const auto at = [&](double share) {
    const auto it = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), it, values.end());
    return *it;
  };
  const float low = at(0.005);
  return {low, 255.0f / std::max(at(0.995) - low, 1.0f)};
}

cv::Mat1b stretched(const cv::Mat1f& image, const Stretch& by) {
  cv::Mat1b out(image.size());
  std::transform(image.begin(), image.end(), out.begin(), [&](float g) {
    return std::isnan(g) ? std::uint8_t{0} : cv::saturate_cast<std::uint8_t>((g - by.low) * by.gain);
  });
  return out;
}

/// Odd side of the matcher's window [px]: grows with the noise of the stretched images, so that a window's sum stays as
/// certain.
int window_side(double noise, int least) {
  constexpr double kBearableNoise = 4.5;  // [grey levels], for the least window
  constexpr int kMost = 11;               // OpenCV's advice
  const int side = static_cast<int>(least * noise / kBearableNoise) | 1;
  return std::max(least, std::min(side, kMost));
}

/// Disparity of the first image's pixels in 1/16 px, below `lower` where unknown. The matcher skips the columns that
/// the largest disparity would take out of the image; a margin gives them back.
cv::Mat1s match(const cv::Mat1b& first, const cv::Mat1b& second, int lower, int steps, const CoarseMatchParameters& p) {
  const int margin = lower + steps;
  cv::Mat wide_first, wide_second;
  cv::copyMakeBorder(first, wide_first, 0, 0, margin, 0, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(second, wide_second, 0, 0, margin, 0, cv::BORDER_REPLICATE);
  const int area = p.window_px * p.window_px;
  const auto matcher = cv::StereoSGBM::create(lower, steps, p.window_px, 8 * area, 32 * area, -1, 31,
                                              p.uniqueness_percent, 0, 0, cv::StereoSGBM::MODE_SGBM);
  cv::Mat1s disparity;
  matcher->compute(wide_first, wide_second, disparity);
  return disparity.colRange(margin, disparity.cols).clone();
}

cv::Mat1b mirrored(const cv::Mat1b& image) {
  cv::Mat1b out;
  cv::flip(image, out, 1);
  return out;
}

}  // namespace

CoarseMatch match_both_ways(const cv::Mat1f& left, const cv::Mat1f& right, double noise, const DisparityRange& range,
                            const CoarseMatchParameters& parameters) {
  const int lower = std::max(0, static_cast<int>(std::floor(range.lower)));
  const int steps = (static_cast<int>(std::ceil(range.upper)) - lower + 16) / 16 * 16;
  const Stretch by = stretch(left, right);
  const cv::Mat1b left8 = stretched(left, by);
  const cv::Mat1b right8 = stretched(right, by);
  CoarseMatchParameters widened = parameters;
  widened.window_px = window_side(noise * by.gain, parameters.window_px);
  cv::Mat1s from_left, from_right;
  tbb::parallel_invoke([&] { from_left = match(left8, right8, lower, steps, widened); },
                       [&] {
                         from_right = match(mirrored(right8), mirrored(left8), lower, steps, widened);
                         cv::flip(from_right, from_right, 1);
                       });

  CoarseMatch out{cv::Mat1f(left.size(), NAN), cv::Mat1f(left.size(), NAN)};
  for (int v = 0; v < left.rows; ++v) {
    for (int u = 0; u < left.cols; ++u) {
      if (from_left(v, u) < lower * 16) continue;
      const float d = static_cast<float>(from_left(v, u)) / 16.0f;
      out.disparity(v, u) = d;
      const int there = static_cast<int>(std::lround(static_cast<float>(u) - d));
      if (there < 0 || there >= right.cols || from_right(v, there) < lower * 16) continue;
      out.disagreement(v, u) = std::abs(d - static_cast<float>(from_right(v, there)) / 16.0f);
    }
  }
  return out;
}

}  // namespace tankrig
