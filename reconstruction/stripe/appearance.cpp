#include "reconstruction/stripe/appearance.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.hpp"
#include "reconstruction/stripe/image_rows.hpp"
#include "reconstruction/stripe/profile_fit.hpp"
#include "reconstruction/stripe/ridge_filter.hpp"
#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr int kSampledColumns = 48;
constexpr double kFilterSigma = 1.6;   ///< [px]
constexpr double kQuantisation = 0.3;  ///< sd of rounding to whole DN

/// A column that the path crosses.
struct Sample {
  std::vector<FourFloats> light;      ///< the channels, less the background's; 0 beyond them
  std::vector<std::uint8_t> clipped;  ///< in any channel
  double row = 0;                     ///< of the path
};

std::vector<Sample> sample_columns(const cv::Mat& image, const cv::Mat& background, const StripeLook& look) {
  std::vector<std::pair<int, double>> crossed;
  for (std::size_t i = 0; i < look.rows.size(); ++i)
    if (!std::isnan(look.rows[i])) crossed.emplace_back(static_cast<int>(i) * look.step + look.step / 2, look.rows[i]);
  const std::size_t step = std::max<std::size_t>(1, crossed.size() / kSampledColumns);
  const int channels = image.channels();
  const auto rows = static_cast<std::size_t>(image.rows);
  std::vector<Sample> samples;
  std::vector<int> columns;
  for (std::size_t i = step / 2; i < crossed.size(); i += step) {
    columns.push_back(crossed[i].first * channels);
    samples.push_back({std::vector<FourFloats>(rows), std::vector<std::uint8_t>(rows), crossed[i].second});
  }
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* in = image.ptr<std::uint8_t>(y);
    const std::uint8_t* dark = background.empty() ? nullptr : background.ptr<std::uint8_t>(y);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      FourFloats light = {};
      bool clipped = false;
      for (int c = 0; c < channels; ++c) {
        const int at = columns[i] + c;
        light[c] = static_cast<float>(dark ? in[at] - dark[at] : in[at]);
        clipped |= in[at] == 255;
      }
      samples[i].light[y] = light;
      samples[i].clipped[y] = clipped;
    }
  }
  return samples;
}

std::vector<float> filter(const std::vector<float>& values, const std::vector<float>& kernel) {
  const int n = static_cast<int>(values.size()), radius = static_cast<int>(kernel.size()) - 1;
  std::vector<float> padded(n + 2 * radius), out(n);
  for (int i = 0; i < n + 2 * radius; ++i) padded[i] = values[std::clamp(i - radius, 0, n - 1)];
  weigh_line(padded.data() + radius, kernel.data(), radius, n, out.data());
  return out;
}

/// Those of filter()'s values that lie `step` apart, from the first. `Value`: one float, or those of the channels.
template <class Value>
std::vector<Value> filter_every(const std::vector<Value>& values, const std::vector<float>& kernel, std::size_t step) {
  const int n = static_cast<int>(values.size()), radius = static_cast<int>(kernel.size()) - 1;
  std::vector<Value> out;
  out.reserve(values.size() / step + 1);
  for (int y = 0; y < n; y += static_cast<int>(step)) {
    Value sum = {};
    if (y >= radius && y + radius < n) {
      for (int k = radius; k > 0; --k) sum += kernel[k] * values[y - k];
      for (int k = 0; k <= radius; ++k) sum += kernel[k] * values[y + k];
    } else {
      for (int k = -radius; k <= radius; ++k) sum += kernel[std::abs(k)] * values[std::clamp(y + k, 0, n - 1)];
    }
    out.push_back(sum);
  }
  return out;
}

/// Into values [first, last) of as many as the sample has rows; the others are left as they are.
void project(const Sample& sample, const std::array<float, 3>& weights, int first, int last,
             std::vector<float>& values) {
  const FourFloats weight = {weights[0], weights[1], weights[2], 0};
  values.resize(sample.light.size());
  for (int y = first; y < last; ++y) {
    const FourFloats weighted = weight * sample.light[y];
    values[y] = weighted[0] + weighted[1] + weighted[2];
  }
}

/// The two ways to weigh the channels: against the scene, and by the stripe's light alone, which a clipped core needs.
struct Weights {
  std::array<float, 3> contrast{}, light{};
};

/// Those that suit a stripe of that sd in the sample.
const std::array<float, 3>& suited(const Weights& weights, const Sample& sample, double sd) {
  const int n = static_cast<int>(sample.clipped.size()), reach = static_cast<int>(std::ceil(2 * sd));
  bool clipped = false;
  for (int y = std::max(0, static_cast<int>(sample.row) - reach);
       y <= std::min(n - 1, static_cast<int>(sample.row) + reach); ++y)
    clipped |= sample.clipped[y] != 0;
  return clipped ? weights.light : weights.contrast;
}

/// About eighty values of each column are enough for its statistics.
std::size_t sample_step(std::size_t size) { return std::max<std::size_t>(1, size / 80); }

/// The stripe's light of each channel above what lies beside it: the median of the columns. Where a channel is clipped
/// the light is not the stripe's colour, but tells how much each channel shows.
Eigen::Vector3d measure_colour(const std::vector<Sample>& samples, int channels, double sd, bool clipped_too) {
  std::array<std::vector<double>, 3> found;
  const int reach = static_cast<int>(std::ceil(2.5 * sd)) + 1;
  for (const Sample& sample : samples) {
    const int middle = static_cast<int>(std::lround(sample.row)), first = middle - reach, last = middle + reach;
    if (first < 1 || last + 1 >= static_cast<int>(sample.light.size())) continue;
    Eigen::Vector3d light = Eigen::Vector3d::Zero();
    for (int y = first + 1; y < last; ++y) {
      if (sample.clipped[y] && !clipped_too) continue;
      for (int c = 0; c < channels; ++c)
        light[c] += sample.light[y][c] - 0.25 * (sample.light[first - 1][c] + sample.light[first][c] +
                                                 sample.light[last][c] + sample.light[last + 1][c]);
    }
    for (int c = 0; c < channels; ++c) found[c].push_back(light[c]);
  }
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  for (int c = 0; c < channels; ++c)
    if (!found[c].empty()) colour[c] = upper_median(found[c]);
  return colour;
}

/// Covariance of the channels' responses away from the stripe, their largest twentieth pulled in.
Eigen::Matrix3d scene_covariance(const std::vector<Sample>& samples, int channels, double sd) {
  const std::vector<float> kernel = ridge_kernel(std::max(kFilterSigma, 1.5 * sd));
  std::array<std::vector<float>, 3> away;
  for (const Sample& sample : samples) {
    const std::size_t step = sample_step(sample.light.size());
    const std::vector<FourFloats> response = filter_every(sample.light, kernel, step);
    for (std::size_t i = 0; i < response.size(); ++i)
      if (std::abs(static_cast<double>(i * step) - sample.row) > 6 * sd + 4)
        for (int c = 0; c < channels; ++c) away[c].push_back(response[i][c]);
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const std::size_t n = away[0].size();
  std::array<float, 3> limit{};
  for (int c = 0; c < channels && n > 0; ++c) {
    std::vector<float> sizes = away[c];
    const double noise = robust_sd(sizes);
    const auto high = sizes.begin() + static_cast<std::ptrdiff_t>(n * 19 / 20);
    std::nth_element(sizes.begin(), high, sizes.end());
    limit[c] = std::max(*high, static_cast<float>(2 * std::max(noise, kQuantisation)));
  }
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::Vector3d r = Eigen::Vector3d::Zero();
    for (int c = 0; c < channels; ++c) r[c] = std::clamp(away[c][i], -limit[c], limit[c]);
    for (int c = 0; c < channels; ++c)
      for (int d = 0; d <= c; ++d) sum(c, d) += r[c] * r[d] / static_cast<double>(n);
  }
  sum = sum.selfadjointView<Eigen::Lower>();
  for (int c = 0; c < 3; ++c) sum(c, c) += c < channels ? kQuantisation * kQuantisation : 1.0;
  return sum;
}

std::vector<float> smoothed(const std::vector<float>& values, double sd) {
  std::vector<float> kernel;
  float sum = 0;
  for (int k = 0; k <= static_cast<int>(std::ceil(3 * sd)); ++k) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * k * k / std::max(0.01, sd * sd))));
    sum += (k ? 2 : 1) * kernel.back();
  }
  for (float& weight : kernel) weight /= sum;
  return filter(values, kernel);
}

/// Full width at half height around each sample's row, to whose middle the row moves; the median's sd.
double measure_extent(std::vector<Sample>& samples, const Weights& weights, double sd) {
  constexpr double kFullWidthOfSd = 2.3548, kSmoothing = 0.5;  // no single grain of speckle is the stripe
  std::vector<double> widths;
  std::vector<float> projected;
  for (Sample& sample : samples) {
    const int n = static_cast<int>(sample.light.size());
    project(sample, suited(weights, sample, sd), 0, n, projected);
    const std::vector<float> values = smoothed(projected, kSmoothing * sd);
    const int middle = std::clamp(static_cast<int>(std::lround(sample.row)), 0, n - 1);
    const int near = static_cast<int>(std::ceil(sd)), far = static_cast<int>(std::ceil(8 * sd)) + 10;
    const auto at = [&](int i) { return values.begin() + std::clamp(i, 0, n); };
    int first = static_cast<int>(std::max_element(at(middle - near), at(middle + near + 1)) - values.begin()),
        last = first;
    std::vector<float> around(at(middle - far), at(middle + far + 1));
    const auto low = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 5);
    std::nth_element(around.begin(), low, around.end());
    const float half = 0.5f * (values[first] + *low);
    while (first > 0 && values[first - 1] >= half) --first;
    while (last + 1 < n && values[last + 1] >= half) ++last;
    if (first == 0 || last + 1 == n) continue;
    const double top = first - (values[first] - half) / (values[first] - values[first - 1]);
    const double bottom = last + (values[last] - half) / (values[last] - values[last + 1]);
    sample.row = 0.5 * (top + bottom);
    widths.push_back(bottom - top);
  }
  if (widths.size() < 3) return sd;
  const double wide = upper_median(widths) / kFullWidthOfSd;
  return std::clamp(std::sqrt(std::max(0.3, wide * wide - std::pow(kSmoothing * sd, 2))), 0.6, 16.0);
}

/// Robust sd of a pixel's weighted value, as far as a filter across the stripe sees it.
double measure_noise(const std::vector<Sample>& samples, const std::array<float, 3>& weights) {
  const std::vector<float> kernel = ridge_kernel(kFilterSigma);
  std::vector<float> values, column;
  for (const Sample& sample : samples) {
    project(sample, weights, 0, static_cast<int>(sample.light.size()), column);
    const std::vector<float> response = filter_every(column, kernel, sample_step(column.size()));
    values.insert(values.end(), response.begin(), response.end());
  }
  return std::max(robust_sd(values), kQuantisation);
}

/// The profile's sd: median of fits at the path.
double measure_width(const std::vector<Sample>& samples, const Weights& weights, double start,
                     const ValueNoise& noise) {
  double sd = start;
  for (int round = 0; round < 6; ++round) {
    const ProfileFitter fitter(sd, true);
    std::vector<double> ratios;
    std::vector<float> values;
    for (const Sample& sample : samples) {
      const int n = static_cast<int>(sample.light.size());
      const auto [first, last] = fitter.window(n, sample.row);
      project(sample, suited(weights, sample, sd), first, last + 1, values);
      const ProfileFit fit = fitter.fit(values.data(), n, sample.row, noise);
      if (fit.ok) ratios.push_back(fit.width_ratio);
    }
    const double ratio = ratios.size() < 3 ? 1.0 : std::clamp(upper_median(ratios), 0.6, 1.6);
    sd = std::clamp(sd * ratio, 0.6, 16.0);
    if (std::abs(ratio - 1) < 0.02) break;
  }
  return sd;
}

}  // namespace

StripeAppearance measure_appearance(const cv::Mat& image, const cv::Mat& background, const StripeLook& look) {
  const int channels = image.channels();
  std::vector<Sample> samples = sample_columns(image, background, look);
  StripeAppearance appearance;
  appearance.detection = appearance.profile = look.weights;
  appearance.sd_px = look.sd_px;
  if (samples.empty()) return appearance;
  Weights weights{look.weights, look.weights};
  for (float& weight : weights.light) weight = std::max(weight, 0.0f);
  const double sd = measure_extent(samples, weights, look.sd_px);
  const Eigen::Vector3d colour = measure_colour(samples, channels, sd, false);
  const Eigen::Vector3d contrast = scene_covariance(samples, channels, sd).ldlt().solve(colour);
  const Eigen::Vector3d guess(look.weights[0], look.weights[1], look.weights[2]);
  Eigen::Vector3d positive = guess.cwiseMax(0.0);
  if (colour.dot(guess) > 0) {
    for (int c = 0; c < 3; ++c) appearance.detection[c] = static_cast<float>(contrast.normalized()[c]);
    positive = measure_colour(samples, channels, sd, true).cwiseMax(0.0);
  }
  positive.normalize();
  for (int c = 0; c < 3; ++c) appearance.light[c] = static_cast<float>(positive[c]);
  appearance.profile = background.empty() ? appearance.detection : appearance.light;
  appearance.noise = measure_noise(samples, appearance.profile);
  appearance.sd_px = measure_width(samples, {appearance.profile, appearance.light}, sd, {appearance.noise, 0});
  return appearance;
}

}  // namespace tankrig
