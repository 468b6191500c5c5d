#include "reconstruction/stripe/appearance.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.hpp"
#include "reconstruction/stripe/plateau_fit.hpp"
#include "reconstruction/stripe/profile_fit.hpp"
#include "reconstruction/stripe/ridge_filter.hpp"

namespace tankrig {
namespace {

constexpr int kSampledColumns = 32;
constexpr int kLevels = 4;             ///< columns binned 1, 2, 4, 8 rows at a time
constexpr double kFilterSigma = 1.6;   ///< [binned px]
constexpr double kQuantisation = 0.3;  ///< sd of rounding to whole DN

using Profile = std::array<std::vector<float>, 3>;  ///< one column, per channel

std::vector<Profile> sample_columns(const cv::Mat& image, const cv::Mat& background, std::vector<int>& columns) {
  const int step = std::max(1, image.cols / kSampledColumns), channels = image.channels();
  for (int x = step / 2; x < image.cols; x += step) columns.push_back(x);
  std::vector<Profile> profiles(columns.size());
  for (Profile& profile : profiles)
    for (int c = 0; c < channels; ++c) profile[c].resize(image.rows);
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* in = image.ptr<std::uint8_t>(y);
    const std::uint8_t* dark = background.empty() ? nullptr : background.ptr<std::uint8_t>(y);
    for (std::size_t i = 0; i < columns.size(); ++i)
      for (int c = 0; c < channels; ++c) {
        const int at = columns[i] * channels + c;
        profiles[i][c][y] = static_cast<float>(in[at]) - (dark ? dark[at] : 0);
      }
  }
  return profiles;
}

void bin_by_two(std::vector<float>& values) {
  const std::size_t n = values.size() / 2;
  for (std::size_t i = 0; i < n; ++i) values[i] = 0.5f * (values[2 * i] + values[2 * i + 1]);
  values.resize(n);
}

std::vector<float> filter(const std::vector<float>& values, const std::vector<float>& kernel) {
  const int n = static_cast<int>(values.size()), radius = static_cast<int>(kernel.size()) - 1;
  std::vector<float> padded(n + 2 * radius), out(n, 0.0f);
  for (int i = 0; i < n + 2 * radius; ++i) padded[i] = values[std::clamp(i - radius, 0, n - 1)];
  for (int k = -radius; k <= radius; ++k) {
    const float h = kernel[std::abs(k)];
    const float* in = padded.data() + radius + k;
    for (int i = 0; i < n; ++i) out[i] += h * in[i];
  }
  return out;
}

std::vector<float> projected(const Profile& profile, const std::array<float, 3>& weights, int channels) {
  std::vector<float> values(profile[0].size(), 0.0f);
  for (int c = 0; c < channels; ++c)
    for (std::size_t y = 0; y < values.size(); ++y) values[y] += weights[c] * profile[c][y];
  return values;
}

/// Index of the largest value, the ends left out where there is something between them.
std::size_t strongest(const std::vector<float>& values) {
  if (values.size() < 3) return 0;
  return static_cast<std::size_t>(std::max_element(values.begin() + 1, values.end() - 1) - values.begin());
}

struct LevelResult {
  double score = 0;
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();  ///< response of the stripe per channel
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
  std::vector<int> peak_row;  ///< per sampled column, in binned rows
  std::vector<double> snr;
};

/// About eighty values of each column are enough for its statistics.
std::size_t sample_step(const std::vector<float>& values) { return std::max<std::size_t>(1, values.size() / 80); }

/// Covariance of the responses, the largest twentieth of each channel pulled in: texture counts, the stripe hardly.
/// A `wide` stripe fills more than a twentieth: everything beyond noise is pulled in.
Eigen::Matrix3d robust_covariance(const std::vector<Profile>& responses, int channels, bool wide) {
  const std::size_t step = sample_step(responses[0][0]);
  Eigen::Vector3d limit = Eigen::Vector3d::Zero();
  for (int c = 0; c < channels; ++c) {
    std::vector<float> sample;
    for (const Profile& response : responses)
      for (std::size_t y = 0; y < response[c].size(); y += step) sample.push_back(response[c][y]);
    const double sd = std::max(robust_sd(sample), kQuantisation);
    const auto high = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() * 19 / 20);
    std::nth_element(sample.begin(), high, sample.end());
    limit[c] = wide ? 2 * sd : std::max<double>(*high, 2 * sd);
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  double n = 0;
  for (const Profile& response : responses)
    for (std::size_t y = 0; y < response[0].size(); y += step) {
      Eigen::Vector3d r = Eigen::Vector3d::Zero();
      for (int c = 0; c < channels; ++c) r[c] = std::clamp<double>(response[c][y], -limit[c], limit[c]);
      sum += r * r.transpose();
      ++n;
    }
  Eigen::Matrix3d covariance = sum / std::max(n, 1.0);
  for (int c = 0; c < 3; ++c) covariance(c, c) += c < channels ? kQuantisation * kQuantisation : 1.0;
  return covariance;
}

/// The colour most of the clearest columns agree on.
Eigen::Vector3d agreed_colour(const std::vector<Eigen::Vector3d>& colours, const std::vector<double>& strength) {
  std::vector<std::size_t> order(colours.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return strength[a] > strength[b]; });
  order.resize(std::min(order.size(), std::max<std::size_t>(5, order.size() / 3)));
  Eigen::Vector3d agreed;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> component;
    for (const std::size_t i : order) component.push_back(colours[i][c]);
    agreed[c] = upper_median(component);
  }
  return agreed;
}

LevelResult measure_level(const std::vector<Profile>& profiles, int channels, bool wide) {
  const std::vector<float> kernel = ridge_kernel(kFilterSigma);
  std::vector<Profile> responses(profiles.size());
  for (std::size_t i = 0; i < profiles.size(); ++i)
    for (int c = 0; c < channels; ++c) responses[i][c] = filter(profiles[i][c], kernel);
  LevelResult level;
  const Eigen::Matrix3d inverse = robust_covariance(responses, channels, wide).inverse();
  // Distance from noise and texture in their own units: squared norm of the whitened response.
  const Eigen::Matrix3f whitening = inverse.llt().matrixU().toDenseMatrix().cast<float>();
  std::vector<Eigen::Vector3d> colours;
  std::vector<double> strength;
  std::vector<float> values;
  for (const Profile& response : responses) {
    values.assign(response[0].size(), 0.0f);
    for (int k = 0; k < channels; ++k) {
      std::array<float, 3> row{};
      for (int c = 0; c < channels; ++c) row[c] = whitening(k, c);
      const std::vector<float> white = projected(response, row, channels);
      for (std::size_t y = 0; y < values.size(); ++y) values[y] += white[y] * white[y];
    }
    const std::vector<float> sum = projected(response, {1, 1, 1}, channels);
    for (std::size_t y = 0; y < values.size(); ++y) values[y] = sum[y] > 0 ? values[y] : 0.0f;
    const std::size_t row = strongest(values);
    Eigen::Vector3d colour = Eigen::Vector3d::Zero();
    for (int c = 0; c < channels; ++c) colour[c] = values[row] > 0 ? response[c][row] : 0.0f;
    colours.push_back(colour);
    strength.push_back(values[row]);
  }
  level.colour = agreed_colour(colours, strength);
  level.weights = inverse * level.colour;
  const double noise = std::sqrt(std::max(level.colour.dot(level.weights), 1e-12));
  const std::array<float, 3> weights{static_cast<float>(level.weights[0]), static_cast<float>(level.weights[1]),
                                     static_cast<float>(level.weights[2])};
  for (const Profile& response : responses) {
    const std::vector<float> value = projected(response, weights, channels);
    const std::size_t row = strongest(value);
    const double snr = std::max(0.0, value[row] / noise);
    level.peak_row.push_back(static_cast<int>(row));
    level.snr.push_back(snr);
    level.score += std::min(snr, 40.0) / static_cast<double>(responses.size());
  }
  return level;
}

/// Typical width of the clipped plateau at the peaks of the clearest columns [px], 0 if most have none.
int plateau_width(const cv::Mat& image, const std::vector<int>& columns, const LevelResult& level) {
  constexpr int kReach = 3;
  const int channels = image.channels();
  std::vector<double> snr = level.snr;
  std::sort(snr.begin(), snr.end(), std::greater<>());
  std::vector<double> widths;
  std::vector<std::uint8_t> clipped(image.rows);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (level.snr[i] < snr[snr.size() / 3]) continue;
    for (int y = 0; y < image.rows; ++y) {
      const std::uint8_t* pixel = image.ptr<std::uint8_t>(y) + static_cast<std::ptrdiff_t>(columns[i]) * channels;
      clipped[y] = *std::max_element(pixel, pixel + channels) == 255;
    }
    widths.push_back(plateau_at(clipped, level.peak_row[i], kReach).width());
  }
  return static_cast<int>(upper_median(widths));
}

/// Robust sd of a pixel's weighted value, as far as a filter across the stripe sees it.
double measure_noise(const std::vector<Profile>& profiles, const std::array<float, 3>& weights, int channels) {
  const std::vector<float> kernel = ridge_kernel(kFilterSigma);
  std::vector<float> sample;
  for (const Profile& profile : profiles) {
    const std::vector<float> response = filter(projected(profile, weights, channels), kernel);
    for (std::size_t y = 0; y < response.size(); y += sample_step(response)) sample.push_back(response[y]);
  }
  return std::max(robust_sd(sample), kQuantisation);
}

/// The clearest third of the columns, where shape is measured.
class ClearColumns {
 public:
  ClearColumns(const std::vector<Profile>& profiles, const LevelResult& level, int binning,
               const std::array<float, 3>& weights, int channels) {
    std::vector<double> snr = level.snr;
    std::sort(snr.begin(), snr.end(), std::greater<>());
    const double limit = snr[snr.size() / 3];
    for (std::size_t i = 0; i < profiles.size(); ++i)
      if (level.snr[i] >= limit)
        columns_.push_back({projected(profiles[i], weights, channels), (level.peak_row[i] + 0.5) * binning - 0.5});
  }

  /// Median of a property of the fits, or `otherwise` if there are too few.
  template <class Property>
  double median(const ProfileFitter& fitter, const ValueNoise& noise, double otherwise, Property property) const {
    std::vector<double> found;
    for (const Column& column : columns_) {
      const ProfileFit fit =
          fitter.fit(column.values.data(), static_cast<int>(column.values.size()), column.row, noise);
      if (fit.ok) found.push_back(property(fit));
    }
    return found.size() < 3 ? otherwise : upper_median(found);
  }

 private:
  struct Column {
    std::vector<float> values;
    double row;
  };
  std::vector<Column> columns_;
};

/// The profile's sd.
double measure_width(const ClearColumns& columns, int binning, const ValueNoise& noise) {
  double sd = kFilterSigma * binning * 0.7;
  for (int round = 0; round < 5; ++round) {
    const double ratio = std::clamp(
        columns.median(ProfileFitter(sd, true), noise, 1.0, [](const ProfileFit& fit) { return fit.width_ratio; }), 0.6,
        1.6);
    sd = std::clamp(sd * ratio, 0.6, 16.0);
    if (std::abs(ratio - 1) < 0.02) break;
  }
  return sd;
}

}  // namespace

StripeAppearance measure_appearance(const cv::Mat& image, const cv::Mat& background) {
  const int channels = image.channels();
  std::vector<int> columns;
  const std::vector<Profile> profiles = sample_columns(image, background, columns);
  std::vector<Profile> binned = profiles;
  LevelResult best;
  int binning = 1, plateau = 0;
  double score = 0;
  for (int k = 0; k < kLevels; ++k) {
    if (k > 0)
      for (Profile& profile : binned)
        for (int c = 0; c < channels; ++c) bin_by_two(profile[c]);
    if (k > 0 && binned[0][0].size() < 16) break;
    LevelResult level = measure_level(binned, channels, plateau >= kWidePlateau);
    if (k == 0) plateau = plateau_width(image, columns, level);
    if (k == 0 && plateau >= kWidePlateau) level = measure_level(binned, channels, true);
    score = std::max(score, level.score);
    // A filter much narrower than a plateau answers to its two edges, and has no peak between them.
    const bool too_narrow = k > 0 && kFilterSigma * (1 << (k - 1)) * 3 < plateau;
    if (k == 0 || too_narrow || level.score > best.score) {
      best = std::move(level);
      binning = 1 << k;
    }
  }
  StripeAppearance appearance;
  appearance.score = score;
  const Eigen::Vector3d positive = best.colour.cwiseMax(0.0);
  // Without a dark image the scene's own steps shift a profile in the stripe's colour less if texture is weighted out.
  Eigen::Vector3d profile = background.empty() ? best.weights : positive;
  profile = profile.norm() > 0 ? profile.normalized() : Eigen::Vector3d::Constant(1 / std::sqrt(3.0)).eval();
  const double norm = best.weights.norm();
  for (int c = 0; c < 3; ++c) {
    appearance.detection[c] = static_cast<float>(norm > 0 ? best.weights[c] / norm : 0.577);
    appearance.profile[c] = static_cast<float>(profile[c]);
  }
  appearance.noise = measure_noise(profiles, appearance.profile, channels);
  const ClearColumns clear(profiles, best, binning, appearance.profile, channels);
  appearance.sd_px = measure_width(clear, binning, {appearance.noise, 0});
  return appearance;
}

}  // namespace tankrig
