#include "reconstruction/stripe/stripe_detector.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

#include "core/input_error.hpp"
#include "core/median.hpp"
#include "reconstruction/stripe/appearance.hpp"
#include "reconstruction/stripe/plateau_fit.hpp"
#include "reconstruction/stripe/profile_fit.hpp"
#include "reconstruction/stripe/ridge_filter.hpp"
#include "reconstruction/stripe/stripe_path.hpp"
#include "reconstruction/stripe/stripe_selection.hpp"
#include "reconstruction/stripe/stripe_smoothing.hpp"

namespace tankrig {
namespace {

constexpr double kFilterOverProfile =
    1.5;                                ///< sd of the filter over that of the profile: near the best SNR, still local
constexpr double kMinProfileSnr = 3.0;  ///< amplitude over its sigma in the local fit
constexpr double kSignificance = 4.0;   ///< sigmas beyond which a shape is not chance

void check(const cv::Mat& image, const cv::Mat& background) {
  if (image.empty() || (image.type() != CV_8UC3 && image.type() != CV_8UC1))
    throw InputError("stripe: found an image that is not 8 bits with 1 or 3 channels, expected one");
  if (!background.empty() && (background.size() != image.size() || background.type() != image.type()))
    throw InputError(fmt::format("stripe: found a background of {}x{}x{}, expected {}x{}x{} as the image",
                                 background.cols, background.rows, background.channels(), image.cols, image.rows,
                                 image.channels()));
}

cv::Mat transposed(const cv::Mat& image) {
  cv::Mat out;
  if (!image.empty()) cv::transpose(image, out);
  return out;
}

/// Another line in this column, almost as strong and continued on both sides.
bool has_rival(const RidgeCandidates& candidates, const PathPoint& point, double sd, const StripeParameters& p) {
  constexpr int kReach = 4, kNeeded = 5;
  for (int k = 0; k < candidates.count(point.column); ++k) {
    const RidgeCandidate& rival = candidates.at(point.column, k);
    if (std::abs(rival.row - point.candidate.row) < 4 * sd + 2) continue;
    if (rival.snr < p.max_second_peak * point.candidate.snr) continue;
    int continued = 0;
    for (int d = -kReach; d <= kReach; ++d) {
      const int column = point.column + d;
      if (d == 0 || column < 0 || column >= candidates.columns()) continue;
      bool found = false;
      for (int j = 0; j < candidates.count(column); ++j)
        found |= std::abs(candidates.at(column, j).row - rival.row) <= p.max_step_px * std::abs(d);
      continued += found;
    }
    if (continued >= kNeeded) return true;
  }
  return false;
}

/// One image whose stripe crosses the columns.
class ColumnDetector {
 public:
  ColumnDetector(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters)
      : image_(image),
        background_(background),
        parameters_(parameters),
        appearance_(measure_appearance(image, background)),
        fitter_(appearance_.sd_px, background.empty()) {}

  StripeDetection detect() {
    static thread_local cv::Mat1f signal, response;  // kept from frame to frame: fresh pages cost as much as the filter
    weighted_signal(image_, background_, appearance_.detection, signal);
    filter_columns(signal, ridge_kernel(std::clamp(kFilterOverProfile * appearance_.sd_px, 1.0, 10.0)), response);
    constexpr double kQuantisation = 0.3, kCandidateShare = 0.85;
    const double noise = std::max(robust_noise(response), kQuantisation);
    const RidgeCandidates candidates(response, noise, kCandidateShare * parameters_.min_snr);
    const std::vector<StripeRun> path = best_path(candidates, parameters_.min_snr, parameters_.max_step_px);

    StripeStatistics& statistics = detection_.statistics;
    statistics.frames = 1;
    statistics.columns = static_cast<std::uint64_t>(image_.cols);
    count_unused_columns(candidates, path);
    contrast_ = measure_contrast(path);
    std::vector<FittedRun> runs;
    for (const StripeRun& run : path) runs.push_back(fit_run(run, candidates));
    std::erase_if(runs, [](const FittedRun& run) { return run.empty(); });
    drop_strangers(runs, parameters_, statistics);
    const std::vector<double> correlations = calibrate_sigmas(runs);
    drop_edges(runs, parameters_, statistics);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (parameters_.smoothing_px > 0) smooth_run(runs[i], parameters_.smoothing_px, correlations[i]);
      for (const RunPoint& point : runs[i]) {
        detection_.peaks.push_back(point.peak);
        float& sigma = detection_.peaks.back().sigma_px;
        sigma = static_cast<float>(std::hypot(sigma, parameters_.speckle_floor_px));
      }
    }
    statistics.peaks = detection_.peaks.size();
    return std::move(detection_);
  }

 private:
  void count_unused_columns(const RidgeCandidates& candidates, const std::vector<StripeRun>& path) {
    std::vector<bool> used(candidates.columns(), false);
    for (const StripeRun& run : path)
      for (const PathPoint& point : run) used[point.column] = true;
    for (int column = 0; column < candidates.columns(); ++column) {
      if (used[column]) continue;
      ++(candidates.count(column) ? detection_.statistics.low_snr : detection_.statistics.no_peak);
    }
  }

  FittedRun fit_run(const StripeRun& run, const RidgeCandidates& candidates) {
    FittedRun out;
    StripeStatistics& statistics = detection_.statistics;
    for (const PathPoint& point : run) {
      const ProfileFit fit = fit_point(point);
      const StripeParameters& p = parameters_;
      if (!fit.ok || fit.amplitude < kMinProfileSnr * fit.amplitude_sigma) {
        ++statistics.low_snr;
      } else if (fit.width_ratio > p.max_width_ratio && fit.width_ratio - 1 > kSignificance * fit.width_sigma) {
        ++statistics.too_wide;
      } else if (std::abs(fit.skewness) > p.max_skew && std::abs(fit.skewness) > kSignificance * fit.skewness_sigma) {
        ++statistics.skewed;
      } else if (has_rival(candidates, point, appearance_.sd_px, p)) {
        ++statistics.ambiguous;
      } else {
        out.push_back({peak_of(point.column, fit), fit.amplitude});
        add_colour(out.back());
      }
    }
    return out;
  }

  /// The values across the stripe, in `values_`.
  struct Section {
    int first_row = 0;
    bool clipped = false;
  };

  Section cut(const PathPoint& point) {
    const int middle = static_cast<int>(std::lround(point.candidate.row));
    const int reach = fitter_.half_window() + 2;
    const int first = std::max(0, middle - reach), last = std::min(image_.rows - 1, middle + reach);
    const int channels = image_.channels();
    Section section{first};
    values_.clear();
    for (int y = first; y <= last; ++y) {
      const std::uint8_t* in = image_.ptr<std::uint8_t>(y) + static_cast<std::ptrdiff_t>(point.column) * channels;
      const std::uint8_t* dark =
          background_.empty() ? nullptr
                              : background_.ptr<std::uint8_t>(y) + static_cast<std::ptrdiff_t>(point.column) * channels;
      float value = 0;
      for (int c = 0; c < channels; ++c) {
        value += appearance_.profile[c] * static_cast<float>(in[c] - (dark ? dark[c] : 0));
        section.clipped |= in[c] == 255;
      }
      values_.push_back(value);
    }
    return section;
  }

  /// Of the pixels that are not clipped, above the mean of two pixels on either side beyond the profile.
  void add_colour(RunPoint& point) const {
    const int channels = image_.channels(), reach = fitter_.half_window();
    const int centre = static_cast<int>(std::lround(point.peak.position));
    const int first = centre - reach, last = centre + reach;
    if (channels < 3 || first < 1 || last + 1 >= image_.rows) return;
    const auto light = [&](int y, int c) {
      const auto at = static_cast<std::ptrdiff_t>(point.peak.column) * channels + c;
      return static_cast<double>(image_.ptr<std::uint8_t>(y)[at]) -
             (background_.empty() ? 0 : background_.ptr<std::uint8_t>(y)[at]);
    };
    Eigen::Vector3d base;
    for (int c = 0; c < 3; ++c)
      base[c] = 0.25 * (light(first - 1, c) + light(first, c) + light(last, c) + light(last + 1, c));
    int used = 0;
    for (int y = first + 1; y < last; ++y) {
      const cv::Vec3b& pixel = image_.at<cv::Vec3b>(y, static_cast<int>(point.peak.column));
      if (pixel[0] == 255 || pixel[1] == 255 || pixel[2] == 255) continue;
      for (int c = 0; c < 3; ++c) point.colour[c] += light(y, c) - base[c];
      ++used;
    }
    point.colour_sigma = appearance_.noise * std::sqrt(used + 0.25 * used * used);
  }

  ProfileFit fit_values(double start, double contrast) const {
    return fitter_.fit(values_.data(), static_cast<int>(values_.size()), start, {appearance_.noise, contrast});
  }

  ProfileFit fit_point(const PathPoint& point) {
    const Section section = cut(point);
    const double start = point.candidate.row - section.first_row;
    ProfileFit fit;
    if (section.clipped && mark_clipped(point.column, section.first_row, false, start) >= kWidePlateau) {
      fit = fit_clipped(point.column, section.first_row, start);
    } else {
      // A clipped core carries no speckle, and its flanks no more than their share.
      fit = fit_values(start, section.clipped ? 0 : contrast_);
    }
    fit.position += section.first_row;
    return fit;
  }

  /// Flags the section's values of which a channel with the stripe's light is clipped, and finds the plateau they form
  /// at `start`; returns its width. `replace`: the values become those of the channels that count, all as lower
  /// bounds, and a channel clipped at the section's ends, as the scene itself is, does not count.
  int mark_clipped(int column, int first_row, bool replace, double start) {
    const int channels = image_.channels(), n = static_cast<int>(values_.size());
    const auto pixel = [&](const cv::Mat& image, int i) {
      return image.ptr<std::uint8_t>(first_row + i) + static_cast<std::ptrdiff_t>(column) * channels;
    };
    std::array<bool, 3> counts{};
    for (int c = 0; c < channels; ++c)
      counts[c] =
          appearance_.profile[c] > 0 && !(replace && (pixel(image_, 0)[c] == 255 || pixel(image_, n - 1)[c] == 255));
    clipped_.assign(n, 0);
    for (int i = 0; i < n; ++i) {
      const std::uint8_t* in = pixel(image_, i);
      float value = 0;
      for (int c = 0; c < channels; ++c) {
        if (!counts[c]) continue;
        clipped_[i] |= in[c] == 255;
        value +=
            appearance_.profile[c] * static_cast<float>(in[c] - (background_.empty() ? 0 : pixel(background_, i)[c]));
      }
      if (replace) values_[i] = value;
    }
    plateau_ = plateau_at(clipped_, static_cast<int>(std::lround(start)), fitter_.half_window() / 2);
    return plateau_.width();
  }

  ProfileFit fit_clipped(int column, int first_row, double start) {
    mark_clipped(column, first_row, true, start);
    constexpr double kFullWidthOfSd = 2.3548;
    PlateauFit fit = fit_plateau(values_, clipped_, plateau_, appearance_.noise, background_.empty());
    fit.profile.width_ratio = std::min(fit.sd_px, fit.half_height_px / kFullWidthOfSd) / appearance_.sd_px;
    return fit.profile;
  }

  /// Speckle's contrast, at which the residuals of some clear sections are as large as the noise lets expect.
  double measure_contrast(const std::vector<StripeRun>& path) {
    constexpr std::size_t kSamples = 48, kLeast = 6;
    constexpr double kMaxContrast = 0.6;
    std::vector<const PathPoint*> clear;
    for (const StripeRun& run : path)
      for (const PathPoint& point : run)
        if (point.candidate.snr >= 2 * parameters_.min_snr) clear.push_back(&point);
    const std::size_t step = std::max<std::size_t>(1, clear.size() / kSamples);
    for (std::size_t i = 0; i < clear.size() / step; ++i) clear[i] = clear[i * step + step / 2];
    clear.resize(clear.size() / step);
    std::erase_if(clear, [&](const PathPoint* point) { return cut(*point).clipped; });
    const std::size_t n = clear.size();
    if (n < kLeast) return 0;
    const auto misfit = [&](double contrast) {
      std::vector<double> all(n, HUGE_VAL);
      for (std::size_t i = 0; i < n; ++i) {
        const PathPoint& point = *clear[i];
        const Section section = cut(point);
        const ProfileFit fit = fit_values(point.candidate.row - section.first_row, contrast);
        if (fit.ok) all[i] = fit.misfit;
      }
      return upper_median(all);
    };
    if (misfit(0) <= 1) return 0;
    double low = 0, high = kMaxContrast;
    for (int round = 0; round < 4; ++round) {
      const double middle = 0.5 * (low + high);
      (misfit(middle) > 1 ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  StripePeak peak_of(int column, const ProfileFit& fit) const {
    const int row = std::clamp(static_cast<int>(std::lround(fit.position)), 0, image_.rows - 1);
    const int channels = image_.channels();
    const std::uint8_t* pixel = image_.ptr<std::uint8_t>(row) + static_cast<std::ptrdiff_t>(column) * channels;
    StripePeak peak;
    peak.column = static_cast<float>(column);
    peak.position = static_cast<float>(fit.position);
    peak.sigma_px = static_cast<float>(fit.sigma);
    peak.intensity = *std::max_element(pixel, pixel + channels) / 255.0f;
    return peak;
  }

  const cv::Mat& image_;
  const cv::Mat& background_;
  const StripeParameters& parameters_;
  StripeAppearance appearance_;
  ProfileFitter fitter_;
  double contrast_ = 0;  ///< of speckle
  std::vector<float> values_;
  std::vector<std::uint8_t> clipped_;  ///< flags of `values_`
  Plateau plateau_;                    ///< in `values_`
  StripeDetection detection_;
};

}  // namespace

OrientationVote find_orientation(const cv::Mat& image, const cv::Mat& background) {
  check(image, background);
  const double columns = measure_appearance(image, background).score;
  const double rows = measure_appearance(transposed(image), transposed(background)).score;
  if (rows > columns) return {StripeOrientation::kRows, rows};
  return {StripeOrientation::kColumns, columns};
}

StripeDetection detect_stripe(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters) {
  check(image, background);
  StripeOrientation orientation = parameters.orientation;
  if (orientation == StripeOrientation::kAuto) orientation = find_orientation(image, background).orientation;
  const bool rows = orientation == StripeOrientation::kRows;
  const cv::Mat across = rows ? transposed(image) : image;
  const cv::Mat dark = rows ? transposed(background) : background;
  StripeDetection detection = ColumnDetector(across, dark, parameters).detect();
  detection.orientation = orientation;
  return detection;
}

}  // namespace tankrig
