#include "reconstruction/stripe/find/appearance.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include "core/median.hpp"
#include "reconstruction/stripe/find/image_rows.hpp"
#include "reconstruction/stripe/find/ridge_filter.hpp"
#include "reconstruction/stripe/fit/profile_fit.hpp"
#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr int kSampledColumns = 48;
constexpr double kFilterSigma = 1.6;  ///< [px]

/// A column that the path crosses.
struct Sample {
  int column = 0;
  double row = 0;         ///< of the path
  std::size_t place = 0;  ///< among the samples
};

std::vector<Sample> sample_columns(const StripeLook& look) {
  std::vector<Sample> crossed, samples;
  for (std::size_t i = 0; i < look.rows.size(); ++i)
    if (!std::isnan(look.rows[i])) crossed.push_back({static_cast<int>(i) * look.step + look.step / 2, look.rows[i]});
  const std::size_t step = std::max<std::size_t>(1, crossed.size() / kSampledColumns);
  for (std::size_t i = step / 2; i < crossed.size(); i += step) {
    samples.push_back(crossed[i]);
    samples.back().place = samples.size() - 1;
  }
  return samples;
}

/// The pixels of the sampled columns, less their background's.
class Pixels {
 public:
  Pixels(const cv::Mat& image, const cv::Mat& background, const std::vector<Sample>& samples)
      : channels_(static_cast<std::size_t>(image.channels())) {
    std::vector<int> columns;
    for (const Sample& sample : samples) columns.push_back(sample.column);
    image_ = sampled_columns(image, columns);
    weighted_signal(image_.reshape(1), sampled_columns(background, columns).reshape(1), {1, 0, 0}, 1, light_);
  }

  int rows() const { return image_.rows; }
  int channels() const { return static_cast<int>(channels_); }

  /// The channels of the sample's pixel; 0 beyond them.
  FourFloats light(int y, const Sample& sample) const {
    const float* const here = light_[y] + sample.place * channels_;
    return channels_ == 1 ? FourFloats{here[0]} : FourFloats{here[0], here[1], here[2]};
  }

  /// The channels of each sample side by side.
  const cv::Mat1f& light() const { return light_; }

  /// In any channel.
  bool clipped(int y, const Sample& sample) const {
    const std::uint8_t* in = image_.ptr<std::uint8_t>(y) + sample.place * channels_;
    return std::any_of(in, in + channels_, [](std::uint8_t value) { return value == 255; });
  }

 private:
  cv::Mat image_;
  cv::Mat1f light_;
  std::size_t channels_;
};

/// About eighty values of each column are enough for its statistics.
int step_of(const cv::Mat1f& light) { return std::max(1, light.rows / 80); }

std::vector<float> filter(const std::vector<float>& values, const std::vector<float>& kernel) {
  const int n = static_cast<int>(values.size()), radius = static_cast<int>(kernel.size()) - 1;
  std::vector<float> padded(n + 2 * radius), out(n);
  for (int i = 0; i < n + 2 * radius; ++i) padded[i] = values[std::clamp(i - radius, 0, n - 1)];
  weigh_line(padded.data() + radius, kernel.data(), radius, n, out.data());
  return out;
}

float weighed(const FourFloats& light, const std::array<float, 3>& weights) {
  return weights[0] * light[0] + weights[1] * light[1] + weights[2] * light[2];
}

/// The weighed light of rows [first, last) of the sample's column.
std::vector<float> project(const Pixels& pixels, const Sample& sample, const std::array<float, 3>& weights, int first,
                           int last) {
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(last - first));
  for (int y = first; y < last; ++y) values.push_back(weighed(pixels.light(y, sample), weights));
  return values;
}

/// The two ways to weigh the channels: against the scene, and by the stripe's light alone, which a clipped core needs.
struct Weights {
  std::array<float, 3> contrast{}, light{};
};

/// Whether a stripe of that sd is clipped in the sample.
bool is_clipped(const Pixels& pixels, const Sample& sample, double sd) {
  const int reach = static_cast<int>(std::ceil(2 * sd));
  bool clipped = false;
  for (int y = std::max(0, static_cast<int>(sample.row) - reach);
       y <= std::min(pixels.rows() - 1, static_cast<int>(sample.row) + reach); ++y)
    clipped |= pixels.clipped(y, sample);
  return clipped;
}

/// Those that suit a stripe of that sd in the sample.
const std::array<float, 3>& suited(const Weights& weights, const Pixels& pixels, const Sample& sample, double sd) {
  return is_clipped(pixels, sample, sd) ? weights.light : weights.contrast;
}

/// The stripe's light of each channel above what lies beside it: the median of the columns. Where a channel is clipped
/// the light is not the stripe's colour, but tells how much each channel shows.
Eigen::Vector3d measure_colour(const Pixels& pixels, const std::vector<Sample>& samples, double sd, bool clipped_too) {
  const int channels = pixels.channels();
  std::array<std::vector<double>, 3> found;
  const int reach = static_cast<int>(std::ceil(2.5 * sd)) + 1;
  for (const Sample& sample : samples) {
    const int middle = static_cast<int>(std::lround(sample.row)), first = middle - reach, last = middle + reach;
    if (first < 1 || last + 1 >= pixels.rows()) continue;
    const auto light_at = [&](int y) { return pixels.light(y, sample); };
    const FourFloats base = 0.25f * (light_at(first - 1) + light_at(first) + light_at(last) + light_at(last + 1));
    FourFloats light = {};
    for (int y = first + 1; y < last; ++y)
      if (clipped_too || !pixels.clipped(y, sample)) light += light_at(y) - base;
    for (int c = 0; c < channels; ++c) found[c].push_back(light[c]);
  }
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  for (int c = 0; c < channels; ++c)
    if (!found[c].empty()) colour[c] = upper_median(found[c]);
  return colour;
}

/// Of three channels: what is at the same place in them.
using Responses = std::array<std::vector<float>, 3>;

/// The channels' responses at every `step`-th row, as far as `wanted(distance from the stripe [px])`.
template <class Wanted>
Responses responses_where(const std::vector<Sample>& samples, const Pixels& pixels, double filter_sd, int step,
                          Wanted wanted) {
  const auto channels = static_cast<std::size_t>(pixels.channels());
  cv::Mat1f response;
  filter_columns(pixels.light(), ridge_kernel(filter_sd), response, step);
  Responses found;
  for (std::vector<float>& channel : found) channel.resize(response.rows * samples.size() + 1);
  std::size_t n = 0;
  for (int i = 0; i < response.rows; ++i) {
    const float* here = response[i];
    for (const Sample& sample : samples) {  // which are wanted changes from row to row: no branch
      for (std::size_t c = 0; c < channels; ++c) found[c][n] = here[c];
      n += wanted(std::abs(i * step - sample.row));
      here += channels;
    }
  }
  for (std::size_t c = 0; c < found.size(); ++c) {
    found[c].resize(n);
    if (c >= channels) std::ranges::fill(found[c], 0.0f);
  }
  return found;
}

/// Sums of the products of each two channels, in the order 00, 10, 11, 20, 21, 22, of values within +-limit.
TANKRIG_VECTORISED
void add_products(const Responses& values, const std::array<float, 3>& limits, double* sums) {
  constexpr std::size_t kLanes = 4;
  FourDoubles all[6] = {};
  const auto add = [&](std::size_t from, auto count) __attribute__((always_inline)) {
    FourDoubles clamped[3];
    for (int c = 0; c < 3; ++c) {
      FourFloats value = {};
      const FourFloats limit = FourFloats{} + limits[c];
      std::memcpy(&value, values[c].data() + from, count * sizeof(float));
      value = value < -limit ? -limit : value;
      value = value > limit ? limit : value;
      clamped[c] = __builtin_convertvector(value, FourDoubles);
    }
    int next = 0;
    for (int c = 0; c < 3; ++c)
      for (int d = 0; d <= c; ++d) all[next++] += clamped[c] * clamped[d];
  };
  const std::size_t n = values[0].size(), rest = n % kLanes;
  for (std::size_t i = 0; i + kLanes <= n; i += kLanes) add(i, std::integral_constant<std::size_t, kLanes>{});
  add(n - rest, rest);
  for (int k = 0; k < 6; ++k) sums[k] = (all[k][0] + all[k][1]) + (all[k][2] + all[k][3]);
}

/// Covariance of the channels' responses away from the stripe by up to `most` rows, at every `step`th row, their largest
/// twentieth pulled in.
Eigen::Matrix3d scene_covariance(const std::vector<Sample>& samples, const Pixels& pixels, double sd, int step,
                                 double most) {
  const double least = 6 * sd + 4;
  const Responses away = responses_where(samples, pixels, std::max(kFilterSigma, 1.5 * sd), step,
                                         [=](double distance) { return (distance > least) & (distance < most); });
  const std::size_t n = away[0].size();
  std::array<float, 3> limit{};
  for (int c = 0; c < pixels.channels() && n > 0; ++c) {
    const std::vector<float> ranked = ranked_sizes(away[c], {n / 2, n * 19 / 20});
    limit[c] = std::max(ranked[1], static_cast<float>(2 * std::max(kSdOfMedian * ranked[0], kQuantisation)));
  }
  double sums[6];
  add_products(away, limit, sums);
  Eigen::Matrix3d covariance;
  for (int c = 0, next = 0; c < 3; ++c)
    for (int d = 0; d <= c; ++d, ++next)
      covariance(c, d) = covariance(d, c) = n > 0 ? sums[next] / static_cast<double>(n) : 0;
  for (int c = 0; c < 3; ++c) covariance(c, c) += c < pixels.channels() ? kQuantisation * kQuantisation : 1.0;
  return covariance;
}

std::vector<float> gauss_kernel(double sd) {
  std::vector<float> kernel;
  float sum = 0;
  for (int k = 0; k <= static_cast<int>(std::ceil(3 * sd)); ++k) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * k * k / std::max(0.01, sd * sd))));
    sum += (k ? 2 : 1) * kernel.back();
  }
  for (float& weight : kernel) weight /= sum;
  return kernel;
}

/// Where a profile crosses half of its height on both sides, in pixels.
struct HalfHeight {
  double top = 0, bottom = 0;
};

/// Of values from row `start` on; none where they end first. The highest is sought up to `near`, the level it stands on up to `far` from `middle`.
std::optional<HalfHeight> half_height(const std::vector<float>& values, int start, int middle, int near, int far) {
  const int n = static_cast<int>(values.size());
  const auto at = [&](int i) { return values.begin() + std::clamp(i, 0, n); };
  int first = static_cast<int>(std::max_element(at(middle - near), at(middle + near + 1)) - values.begin()),
      last = first;
  std::vector<float> around(at(middle - far), at(middle + far + 1));
  const auto low = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 5);
  std::nth_element(around.begin(), low, around.end());
  const float half = 0.5f * (values[first] + *low);
  while (first > 0 && values[first - 1] >= half) --first;
  while (last + 1 < n && values[last + 1] >= half) ++last;
  if (first == 0 || last + 1 == n) return std::nullopt;
  return HalfHeight{start + first - (values[first] - half) / (values[first] - values[first - 1]),
                    start + last + (values[last] - half) / (values[last] - values[last + 1])};
}

/// Full width at half height around each sample's row, to whose middle the row moves; the median's sd.
double measure_extent(const Pixels& pixels, std::vector<Sample>& samples, const Weights& weights, double sd) {
  constexpr double kFullWidthOfSd = 2.3548, kSmoothing = 0.5;  // no single grain of speckle is the stripe
  const int near = static_cast<int>(std::ceil(sd)), far = static_cast<int>(std::ceil(8 * sd)) + 10;
  const int blur = static_cast<int>(std::ceil(3 * kSmoothing * sd));
  const int n = pixels.rows();
  const std::vector<float> kernel = gauss_kernel(kSmoothing * sd);
  std::vector<double> widths;
  for (Sample& sample : samples) {
    const int middle = std::clamp(static_cast<int>(std::lround(sample.row)), 0, n - 1);
    const std::array<float, 3>& suitable = suited(weights, pixels, sample, sd);
    std::optional<HalfHeight> found;
    // Nearly always the profile ends in what is looked at for its height; where it does not, the whole column is.
    for (int reach = far; !found; reach = n) {
      const int first = std::max(0, middle - reach - blur), last = std::min(n, middle + reach + 1 + blur);
      std::vector<float> values = filter(project(pixels, sample, suitable, first, last), kernel);
      const int cut_first = first > 0 ? blur : 0, cut_last = last < n ? blur : 0;  // they lack what lies beyond
      values.resize(values.size() - cut_last);
      values.erase(values.begin(), values.begin() + cut_first);
      const int start = first + cut_first;
      found = half_height(values, start, middle - start, near, far);
      if (first == 0 && last == n) break;
    }
    if (!found) continue;
    sample.row = 0.5 * (found->top + found->bottom);
    widths.push_back(found->bottom - found->top);
  }
  if (widths.size() < 3) return sd;
  const double wide = upper_median(widths) / kFullWidthOfSd;
  return std::clamp(std::sqrt(std::max(0.3, wide * wide - std::pow(kSmoothing * sd, 2))), 0.6, 16.0);
}

/// Robust sd of a pixel's weighted value, as far as a filter across the stripe sees it, at every `step`th row within `most`
/// rows of the stripe.
double measure_noise(const std::vector<Sample>& samples, const Pixels& pixels, const std::array<float, 3>& weights,
                     int step, double most) {
  const Responses near =
      responses_where(samples, pixels, kFilterSigma, step, [=](double distance) { return distance < most; });
  std::vector<float> values(near[0].size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = weights[0] * near[0][i] + weights[1] * near[1][i] + weights[2] * near[2][i];
  return std::max(robust_sd(values), kQuantisation);
}

/// The profile's sd: median of fits at the path.
double measure_width(const Pixels& pixels, const std::vector<Sample>& samples, const Weights& weights, double start,
                     const ValueNoise& noise) {
  double sd = start;
  for (int round = 0; round < 6; ++round) {
    const ProfileFitter fitter(sd, true);
    const int most = 2 * fitter.half_window() + 1;
    std::vector<float> values(samples.size() * most);
    std::vector<ProfileSection> sections;
    for (const Sample& sample : samples) {
      const auto [first, last] = fitter.window(pixels.rows(), sample.row);
      float* const section = values.data() + sections.size() * most;
      std::ranges::copy(project(pixels, sample, suited(weights, pixels, sample, sd), first, last + 1), section);
      sections.push_back({section, last + 1 - first, sample.row - first});
    }
    std::vector<double> ratios;
    for (const ProfileFit& fit : fitter.fit(sections, noise))
      if (fit.ok) ratios.push_back(fit.width_ratio);
    const double ratio = ratios.size() < 3 ? 1.0 : std::clamp(upper_median(ratios), 0.6, 1.6);
    sd = std::clamp(sd * ratio, 0.6, 16.0);
    if (std::abs(ratio - 1) < 0.02) break;
  }
  return sd;
}

}  // namespace

StripeAppearance measure_appearance(const cv::Mat& image, const cv::Mat& background, const StripeLook& look) {
  constexpr std::size_t kFew = 8;
  constexpr double kClearlyLess = 0.7;  // of the variance: the few rows near the stripe tell it roughly
  std::vector<Sample> samples = sample_columns(look);
  StripeAppearance appearance;
  appearance.detection = appearance.profile = look.weights;
  appearance.sd_px = look.sd_px;
  if (samples.empty()) return appearance;
  Weights weights{look.weights, look.weights};
  for (float& weight : weights.light) weight = std::max(weight, 0.0f);
  const Pixels pixels(image, background, samples);
  const double sd = measure_extent(pixels, samples, weights, look.sd_px);
  const Eigen::Vector3d colour = measure_colour(pixels, samples, sd, false);
  int step = step_of(pixels.light());
  double most = HUGE_VAL;  // rows away from the stripe, of what its profile is told from
  const Eigen::Vector3d contrast = scene_covariance(samples, pixels, sd, step, most).ldlt().solve(colour);
  const Eigen::Vector3d guess(look.weights[0], look.weights[1], look.weights[2]);
  Eigen::Vector3d positive = guess.cwiseMax(0.0);
  const auto unit = [](const Eigen::Vector3d& v) {
    const Eigen::Vector3f u = v.normalized().cast<float>();
    return std::array<float, 3>{u[0], u[1], u[2]};
  };
  if (colour.dot(guess) > 0) {
    appearance.colour = colour;
    appearance.detection = appearance.profile = unit(contrast);
    positive = measure_colour(pixels, samples, sd, true).cwiseMax(0.0);
    if (background.empty() && pixels.channels() > 1) {
      // The stripe is told from the whole scene, but its profile lies on the surface beside it.
      const double near = 12 * sd + 24;
      const Eigen::Matrix3d beside = scene_covariance(samples, pixels, sd, 1, near);
      const Eigen::Vector3d suited_there = beside.ldlt().solve(colour);
      const double usual = contrast.dot(beside * contrast) / std::pow(contrast.dot(colour), 2);
      if (1 / suited_there.dot(colour) < kClearlyLess * usual) {
        appearance.profile = unit(suited_there);
        step = 1, most = near;
      }
    }
  }
  appearance.light = unit(positive);
  if (!background.empty()) appearance.profile = appearance.light;
  appearance.noise = measure_noise(samples, pixels, appearance.profile, step, most);
  appearance.sd_px = measure_width(pixels, samples, {appearance.profile, appearance.light}, sd, {appearance.noise, 0});
  if (background.empty() && pixels.channels() > 1) {
    appearance.faintest[std::ranges::min_element(appearance.light) - appearance.light.begin()] = 1;
    std::erase_if(samples, [&](const Sample& sample) { return !is_clipped(pixels, sample, sd); });
    if (samples.size() >= kFew)
      appearance.faintest_sd_px = measure_width(pixels, samples, {appearance.faintest, appearance.faintest},
                                                appearance.sd_px, {appearance.noise, 0});
  }
  return appearance;
}

}  // namespace tankrig
