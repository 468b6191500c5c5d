// Noise first, then a mean per pixel that leaves out what noise does not explain.
#include "reconstruction/stereo/temporal_mean.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr float kQuantisationVariance = 1.0f / 12.0f;
constexpr float kDitherVariance = 0.25f;  ///< [grey levels^2]
constexpr int kBlockPx = 16;

/// Noise variance of a single image: high-pass energy of its smoothest tenth of blocks (J. Immerkaer 1996's mask).
float spatial_noise_variance(const cv::Mat1b& image) {
  const cv::Matx33f mask(1, -2, 1, -2, 4, -2, 1, -2, 1);  // sum of squares 36
  cv::Mat1f high;
  cv::filter2D(image, high, CV_32F, mask);
  std::vector<float> energy;
  for (int v = 1; v + kBlockPx < image.rows; v += kBlockPx)
    for (int u = 1; u + kBlockPx < image.cols; u += kBlockPx)
      energy.push_back(static_cast<float>(cv::mean(
                           high(cv::Rect(u, v, kBlockPx, kBlockPx)).mul(high(cv::Rect(u, v, kBlockPx, kBlockPx))))[0]) /
                       36.0f);
  if (energy.empty()) return 0;
  const auto tenth = energy.begin() + static_cast<std::ptrdiff_t>(energy.size() / 10);
  std::nth_element(energy.begin(), tenth, energy.end());
  return *tenth;
}

/// Noise variance of one image, per block of pixels and smooth in between: half the squared steps from image to image,
/// without the largest three tenths, which a passing particle makes.
cv::Mat1f temporal_noise_variance(const std::vector<cv::Mat1b>& images) {
  constexpr double kKept = 0.7;
  constexpr double kGaussianShare = 0.3097;  // mean of the smallest 70 % of a unit Gaussian's squares
  const cv::Size size = images.front().size();
  cv::Mat1f blocks((size.height + kBlockPx - 1) / kBlockPx, (size.width + kBlockPx - 1) / kBlockPx);
  tbb::parallel_for(0, blocks.rows, [&](int j) {
    std::vector<int> squares;
    for (int i = 0; i < blocks.cols; ++i) {
      const cv::Rect block = cv::Rect(i * kBlockPx, j * kBlockPx, kBlockPx, kBlockPx) & cv::Rect({0, 0}, size);
      squares.clear();
      for (std::size_t k = 1; k < images.size(); ++k)
        for (int v = block.y; v < block.br().y; ++v)
          for (int u = block.x; u < block.br().x; ++u) {
            const int step = images[k](v, u) - images[k - 1](v, u);
            squares.push_back(step * step);
          }
      const auto kept = static_cast<std::ptrdiff_t>(std::ceil(kKept * static_cast<double>(squares.size())));
      std::nth_element(squares.begin(), squares.begin() + kept - 1, squares.end());
      const double sum = std::accumulate(squares.begin(), squares.begin() + kept, 0.0);
      blocks(j, i) = static_cast<float>(sum / static_cast<double>(kept) / kGaussianShare / 2);
    }
  });
  cv::Mat1f smooth;
  cv::resize(blocks, smooth, {blocks.cols * kBlockPx, blocks.rows * kBlockPx}, 0, 0, cv::INTER_LINEAR);
  return smooth(cv::Rect({0, 0}, size)).clone();
}

}  // namespace

TemporalMean temporal_mean(const std::vector<cv::Mat1b>& images) {
  const cv::Size size = images.front().size();
  TemporalMean out;
  if (images.size() == 1) {
    images.front().convertTo(out.mean, CV_32F);
    const float variance = spatial_noise_variance(images.front());
    out.variance = cv::Mat1f(size, std::max(variance, kQuantisationVariance));
    out.noise = std::sqrt(variance);
    return out;
  }

  const cv::Mat1f single = temporal_noise_variance(images);
  std::vector<float> values(single.begin(), single.end());
  out.noise = std::sqrt(upper_median(values));
  out.mean.create(size);
  out.variance.create(size);
  tbb::parallel_for(0, size.height, [&](int v) {
    std::vector<float> samples(images.size());
    for (int u = 0; u < size.width; ++u) {
      for (std::size_t i = 0; i < images.size(); ++i) samples[i] = images[i](v, u);
      std::sort(samples.begin(), samples.end());
      const std::size_t n = samples.size();
      const float median = 0.5f * (samples[(n - 1) / 2] + samples[n / 2]);
      const float limit = 3.0f * std::sqrt(std::max(single(v, u), kDitherVariance));
      float sum = 0, kept = 0;
      for (const float s : samples) {
        if (std::abs(s - median) > limit) continue;
        sum += s - median;
        ++kept;
      }
      out.mean(v, u) = kept > 0 ? median + sum / kept : median;
      // Less noise than it takes to dither the rounding, and averaging does not take the rounding away.
      const float rounding = single(v, u) < kDitherVariance ? kQuantisationVariance : 0.0f;
      out.variance(v, u) = std::max((single(v, u) + kQuantisationVariance) / std::max(kept, 1.0f), rounding);
    }
  });
  return out;
}

}  // namespace tankrig
