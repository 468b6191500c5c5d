// The chain: average, rectify, match both ways, test texture, drop edges, refine, triangulate; every drop counted.

#include "reconstruction/stereo/stereo.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/input_error.hpp"
#include "reconstruction/stereo/coarse_match.hpp"
#include "reconstruction/stereo/rectifier.hpp"
#include "reconstruction/stereo/slanted_refinement.hpp"
#include "reconstruction/stereo/temporal_mean.hpp"

namespace tankrig {
namespace {

constexpr double kSmoothingSigmaPx = 0.8;

/// Why a pixel gives no point, in the order of the tests.
enum Verdict : std::uint8_t {
  kPoint,
  kOutside,
  kNoTexture,
  kNoMatch,
  kLeftRight,
  kEdge,
  kSupport,
  kBadFit,
  kUncertain,
  kDepth,
  kIsland,
  kVerdicts
};

constexpr std::array<const char*, kVerdicts> kReasons = {
    "",
    "outside one of the images",
    "no texture above noise",
    "no unique match",
    "left and right disagree",
    "depth discontinuity",
    "too little of the surface in the window",
    "windows do not fit",
    "disparity too uncertain",
    "depth out of range",
    "small island",
};

/// Both eyes, rectified, averaged and smoothed; variances are of the averages before smoothing.
struct Eyes {
  cv::Mat1f left, right;
  cv::Mat1f intensity;
  cv::Mat1f left_variance, right_variance;
  double noise = 0;
  double smoothing_energy = 1;   ///< sum of squared weights of the smoothing filter
  double derivative_energy = 1;  ///< the same of smoothing and central difference
};

TemporalMean average(const std::vector<StereoPair>& pairs, cv::Mat StereoPair::*eye, cv::Size size) {
  std::vector<cv::Mat1b> images;
  images.reserve(pairs.size());
  for (const StereoPair& pair : pairs) images.push_back(grey_image(pair.*eye, size));
  return temporal_mean(images);
}

Eyes look(const std::vector<StereoPair>& pairs, const Rectifier& rectifier) {
  const TemporalMean left = average(pairs, &StereoPair::left, rectifier.size());
  const TemporalMean right = average(pairs, &StereoPair::right, rectifier.size());
  Eyes eyes;
  eyes.noise = std::max(left.noise, right.noise);
  eyes.intensity = rectifier.left_fine(left.mean);
  eyes.left_variance = rectifier.left_fine(left.variance);
  eyes.right_variance = rectifier.right_fine(right.variance);
  const cv::Size kernel(7, 7);
  cv::GaussianBlur(eyes.intensity, eyes.left, kernel, kSmoothingSigmaPx);
  cv::GaussianBlur(rectifier.right_fine(right.mean), eyes.right, kernel, kSmoothingSigmaPx);

  const cv::Mat1d k = cv::getGaussianKernel(kernel.width, kSmoothingSigmaPx);
  double column = 0, derivative = 0;
  for (int i = 0; i < k.rows; ++i) column += k(i) * k(i);
  for (int i = -1; i <= k.rows; ++i) {
    const double before = i >= 1 ? k(i - 1) : 0;
    const double after = i + 1 < k.rows ? k(i + 1) : 0;
    derivative += 0.25 * (after - before) * (after - before);
  }
  eyes.smoothing_energy = column * column;
  eyes.derivative_energy = column * derivative;
  return eyes;
}

/// Radius of each pixel's window [px], 0 where no window will do. A window does if its horizontal gradients are more
/// than noise makes and enough for a disparity of `max_sigma_px`. The first of three sizes is taken that is enough for
/// half that sigma, or else the largest.
cv::Mat1b window_radii(const Eyes& eyes, const cv::Mat1f& noise_variance, const StereoParameters& p) {
  cv::Mat1f squared(eyes.left.size(), 0.0f);
  for (int v = 0; v < squared.rows; ++v) {
    for (int u = 1; u + 1 < squared.cols; ++u) {
      const float gradient = 0.5f * (eyes.left(v, u + 1) - eyes.left(v, u - 1));
      if (!std::isnan(gradient)) squared(v, u) = gradient * gradient;
    }
  }
  constexpr int kWidest = 3;
  cv::Mat1b radii(squared.size(), std::uint8_t{0});
  for (int scale = 1; scale <= kWidest; ++scale) {
    const int radius = scale * p.window_radius_px;
    const int side = 2 * radius + 1;
    const double max_sigma = scale < kWidest ? 0.5 * p.max_sigma_px : p.max_sigma_px;
    const double over_noise = 1 + (p.texture_to_noise - 1) / scale;  // chance evens out in a larger window
    cv::Mat1f energy;
    cv::boxFilter(squared, energy, CV_32F, {side, side}, {-1, -1}, false);
    for (int v = 0; v < radii.rows; ++v) {
      for (int u = 0; u < radii.cols; ++u) {
        if (radii(v, u) > 0) continue;
        const double from_noise = eyes.left_variance(v, u) * eyes.derivative_energy * side * side;
        const double from_scene = energy(v, u) - from_noise;
        if (energy(v, u) > over_noise * from_noise && from_scene * max_sigma * max_sigma > noise_variance(v, u))
          radii(v, u) = static_cast<std::uint8_t>(radius);
      }
    }
  }
  return radii;
}

/// True within 3 pixels of a jump of the disparity by more than `jump`.
cv::Mat1b discontinuities(const cv::Mat1f& disparity, double jump) {
  const float far = 1e6f;
  cv::Mat1f low = disparity.clone(), high = disparity.clone();
  for (int v = 0; v < disparity.rows; ++v)
    for (int u = 0; u < disparity.cols; ++u)
      if (std::isnan(disparity(v, u))) {
        low(v, u) = far;
        high(v, u) = -far;
      }
  const cv::Mat square = cv::Mat::ones(5, 5, CV_8U);
  cv::erode(low, low, square);
  cv::dilate(high, high, square);
  const cv::Mat1b jumps = (high - low) > jump;
  cv::Mat1b out;
  cv::dilate(jumps, out, cv::Mat::ones(3, 3, CV_8U));
  return out;
}

/// Turns pixels of connected regions smaller than `min_region` from kPoint to kIsland.
void drop_islands(const cv::Mat1f& disparity, cv::Mat1b& verdict, int min_region) {
  constexpr float kStepPx = 1.0f;
  cv::Mat1b seen(verdict.size(), std::uint8_t{0});
  std::vector<cv::Point> region;
  for (int v = 0; v < verdict.rows; ++v) {
    for (int u = 0; u < verdict.cols; ++u) {
      if (verdict(v, u) != kPoint || seen(v, u)) continue;
      region.assign(1, {u, v});
      seen(v, u) = 1;
      for (std::size_t i = 0; i < region.size(); ++i) {
        const cv::Point p = region[i];
        for (const cv::Point step : {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
          const cv::Point q = p + step;
          if (!cv::Rect({0, 0}, verdict.size()).contains(q) || verdict(q) != kPoint || seen(q)) continue;
          if (std::abs(disparity(q) - disparity(p)) > kStepPx) continue;
          seen(q) = 1;
          region.push_back(q);
        }
      }
      if (static_cast<int>(region.size()) < min_region)
        for (const cv::Point p : region) verdict(p) = kIsland;
    }
  }
}

}  // namespace

StereoResult reconstruct(const std::vector<StereoPair>& pairs, const StereoCalibration& calibration,
                         const StereoParameters& p) {
  if (pairs.empty()) throw InputError("stereo: no image pairs, expected at least one");
  const Rectifier rectifier(calibration);
  const Eyes eyes = look(pairs, rectifier);
  const cv::Mat1f noise_variance = eyes.left_variance + eyes.right_variance;
  const cv::Mat1b radii = window_radii(eyes, noise_variance, p);

  const DisparityRange range = {rectifier.disparity(p.max_depth_m), rectifier.disparity(p.min_depth_m)};
  const CoarseMatch match = match_both_ways(eyes.left, eyes.right, eyes.noise / std::sqrt(pairs.size()), range,
                                            {p.match_window_px, p.uniqueness_percent});
  const cv::Mat1b edges = discontinuities(match.disparity, p.edge_jump_px);

  const cv::Size size = rectifier.size();
  cv::Mat1b verdict(size, std::uint8_t{kPoint});
  cv::Mat1f coarse(size, NAN);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      std::uint8_t& why = verdict(v, u);
      if (std::isnan(eyes.left(v, u)))
        why = kOutside;
      else if (radii(v, u) == 0)
        why = kNoTexture;
      else if (std::isnan(match.disparity(v, u)))
        why = kNoMatch;
      else if (!(match.disagreement(v, u) <= p.left_right_px))
        why = kLeftRight;
      else if (edges(v, u))
        why = kEdge;
      if (why == kPoint || why == kEdge) coarse(v, u) = match.disparity(v, u);
    }
  }

  const RefinedDisparity fine =
      refine_slanted(eyes.left, eyes.right, coarse, radii, noise_variance, eyes.smoothing_energy);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      std::uint8_t& why = verdict(v, u);
      if (why != kPoint) continue;
      const double depth = rectifier.depth(fine.disparity(v, u));
      if (!(fine.support(v, u) >= p.min_support))
        why = kSupport;
      else if (!(fine.correlation(v, u) >= p.min_correlation))
        why = kBadFit;
      else if (!(fine.sigma(v, u) <= p.max_sigma_px))
        why = kUncertain;
      else if (!(depth >= p.min_depth_m && depth <= p.max_depth_m))
        why = kDepth;
    }
  }
  drop_islands(fine.disparity, verdict, p.min_region_px);

  StereoResult result;
  result.pairs = static_cast<int>(pairs.size());
  result.pixels = verdict.total();
  result.noise = eyes.noise;
  std::array<std::size_t, kVerdicts> count{};
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      ++count[verdict(v, u)];
      if (verdict(v, u) != kPoint) continue;
      const double d = fine.disparity(v, u);
      CloudPoint point;
      point.p = rectifier.point(u, v, d);
      point.intensity = std::clamp(eyes.intensity(v, u) / 255.0f, 0.0f, 1.0f);
      point.frame = pairs.front().frame;
      point.column = static_cast<float>(rectifier.raw_left(u, v).x());
      point.sigma = static_cast<float>(point.p.norm() / d * fine.sigma(v, u));
      result.cloud.points.push_back(point);
    }
  }
  for (std::size_t i = 1; i < kVerdicts; ++i)
    if (count[i] > 0) result.rejected.push_back({kReasons[i], count[i]});
  if (result.cloud.points.empty()) {
    const auto most = std::max_element(count.begin() + 1, count.end());
    const auto percent = static_cast<int>(100.0 * static_cast<double>(*most) / static_cast<double>(result.pixels));
    result.reason =
        fmt::format("{}: {} % of pixels", kReasons[static_cast<std::size_t>(most - count.begin())], percent);
  }
  return result;
}

}  // namespace tankrig
