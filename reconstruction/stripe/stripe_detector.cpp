#include "reconstruction/stripe/stripe_detector.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/core.hpp>
#include <optional>

#include "core/input_error.hpp"
#include "core/median.hpp"
#include "reconstruction/stripe/appearance.hpp"
#include "reconstruction/stripe/clipped_runs.hpp"
#include "reconstruction/stripe/plateau_fit.hpp"
#include "reconstruction/stripe/profile_fit.hpp"
#include "reconstruction/stripe/ridge_filter.hpp"
#include "reconstruction/stripe/stripe_path.hpp"
#include "reconstruction/stripe/stripe_selection.hpp"
#include "reconstruction/stripe/stripe_smoothing.hpp"

namespace tankrig {
namespace {

constexpr double kMinProfileSnr = 3.0;   ///< amplitude over its sigma in the local fit
constexpr double kSureProfileSnr = 1.5;  ///< likewise where the look's path runs
constexpr double kBetter = 0.7;          ///< misfit of a model over that of the usual one, from which it is believed
constexpr float kEdge = 0.7f, kDarkest = 0.03f;  ///< of the reflectance over its largest
constexpr int kAll = std::numeric_limits<int>::max();
constexpr int kCoreReach = 10;         ///< [px] to either side of a white core
constexpr double kSkirt = 20;          ///< [DN] of the stripe's colour beside its white core
constexpr double kSignificance = 4.0;  ///< sigmas beyond which a shape is not chance
constexpr double kBlurred = 0.5;       ///< [DN] noise that leaves no bands of a smooth light's rounding
constexpr double kBand = 1.5;          ///< [DN] in each channel: more than the height of such a band

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
  constexpr int kReach = 6, kNeeded = 9;
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
  ColumnDetector(const cv::Mat& image, const cv::Mat& background, const StripeLook& look,
                 const StripeParameters& parameters)
      : image_(image),
        background_(background),
        parameters_(parameters),
        look_(look),
        appearance_(measure_appearance(image, background, look)),
        clipped_(image, appearance_.light),
        faintest_(faintest_channel(appearance_.light, background)),
        cores_(image, faintest_),
        fitter_(appearance_.sd_px, background.empty()) {}

  StripeDetection detect() {
    const RidgeCandidates candidates = find_candidates();
    const std::vector<StripeRun> path = path_through(candidates);

    StripeStatistics& statistics = detection_.statistics;
    statistics.frames = 1;
    statistics.columns = static_cast<std::uint64_t>(image_.cols);
    count_unused_columns(candidates, path);
    contrast_ = look_.contrast ? *look_.contrast : scatters_along(path).best();
    std::vector<FittedRun> runs;
    const std::vector<std::vector<FittedPoint>> fitted = fit_points(path);
    measure_shape(fitted);
    for (const auto& run : fitted) runs.push_back(chosen_of(run, candidates));
    std::erase_if(runs, [](const FittedRun& run) { return run.empty(); });
    drop_strangers(runs, parameters_, statistics);
    const std::vector<double> correlations = calibrate_sigmas(runs);
    drop_edges(runs, parameters_, statistics);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      smooth_run(runs[i], parameters_.smoothing_px, correlations[i]);
      for (const RunPoint& point : runs[i]) {
        detection_.peaks.push_back(point.peak);
        float& sigma = detection_.peaks.back().sigma_px;
        sigma = std::max(sigma, static_cast<float>(parameters_.speckle_floor_px));
      }
    }
    statistics.peaks = detection_.peaks.size();
    return std::move(detection_);
  }

  ContrastScatters measure_contrasts() { return scatters_along(path_through(find_candidates())); }

 private:
  RidgeCandidates find_candidates() {
    static thread_local cv::Mat1f signal, response;  // kept from frame to frame: fresh pages cost as much as the filter
    weighted_signal(image_, background_, appearance_.detection, signal);
    fill_clipped(signal);
    const std::vector<float> kernel = ridge_kernel(std::clamp(kFilterOverProfile * appearance_.sd_px, 1.0, 10.0));
    filter_columns(signal, kernel, response);
    constexpr double kQuantisation = 0.3, kCandidateShare = 0.85;
    const double noise = std::max(robust_noise(response), kQuantisation);
    if (background_.empty()) weaken_edges(signal, kernel, response);
    RidgeCandidates candidates(response, noise, kCandidateShare * parameters_.min_snr);
    typical_snr_ = typical_snr(response, look_) / noise;
    add_weak(response, noise, candidates);
    add_cores(candidates);
    return candidates;
  }

  /// Of the laser's light, the channel that shows least. Where it clips with the stripe's colour on both sides, there is
  /// the stripe's core, however far the others clip in its haze. None where a dark image tells the haze.
  static std::array<float, 3> faintest_channel(const std::array<float, 3>& light, const cv::Mat& background) {
    std::array<float, 3> weights{};
    if (background.empty()) weights[std::ranges::min_element(light) - light.begin()] = 1;
    return weights;
  }

  void add_cores(RidgeCandidates& candidates) const {
    if (image_.channels() < 3) return;
    const double widest = 4 * appearance_.sd_px;
    for (int x = 0; x < image_.cols; ++x)
      for (const ClippedRun& core : cores_.of(x))
        if (core.width() <= widest &&
            std::min(colour_beside(x, core.first, -1), colour_beside(x, core.last, 1)) > kSkirt)
          candidates.add(x,
                         {0.5f * static_cast<float>(core.first + core.last),
                          static_cast<float>(std::max(3 * typical_snr_, 2 * parameters_.min_snr))},
                         true);
  }

  /// How much of the stripe's colour the pixels beyond a core's end have, against grey [DN].
  double colour_beside(int column, int end, int step) const {
    constexpr int kPixels = 3;
    double colour = 0;
    for (int k = 1; k <= kPixels; ++k) {
      const int y = end + k * step;
      if (y < 0 || y >= image_.rows) return 0;
      const cv::Vec3b& pixel = image_.at<cv::Vec3b>(y, column);
      for (int c = 0; c < 3; ++c) colour += look_.weights[c] * pixel[c] / kPixels;
    }
    return colour;
  }

  std::vector<StripeRun> path_through(const RidgeCandidates& candidates) const {
    return best_path(candidates, parameters_.min_snr, parameters_.max_step_px, typical_snr_);
  }

  /// Where the look's path is sure of a stripe, what is weaker than the noise lets tell in one column is enough.
  void add_weak(const cv::Mat1f& response, double noise, RidgeCandidates& candidates) const {
    constexpr double kSure = 1.0;  // evidence per column of the reduced image, several times that of noise
    constexpr double kLeastSnr = 1.0;
    // Where the whole stripe is weak among the scene's lines, a column's SNR counts as enough to bear the step to it.
    const bool weak = background_.empty() && typical_snr_ < 2 * parameters_.min_snr;
    const double most = (weak ? 1.5 : 1.0) * parameters_.min_snr, known = (weak ? 1.5 : 1.1) * parameters_.min_snr;
    sure_rows_.assign(response.cols, NAN);
    if (look_.evidence <= kSure * static_cast<double>(look_.rows.size())) return;
    const double reach = look_.step + appearance_.sd_px;
    for (int x = 0; x < response.cols; ++x) {
      const double at = static_cast<double>(x) / look_.step - 0.5 + 0.5 / look_.step;
      const int left = std::clamp(static_cast<int>(std::floor(at)), 0, static_cast<int>(look_.rows.size()) - 1);
      const int right = std::min(left + 1, static_cast<int>(look_.rows.size()) - 1);
      const double share = std::clamp(at - left, 0.0, 1.0);
      double row = (1 - share) * look_.rows[left] + share * look_.rows[right];
      if (std::isnan(row)) row = std::isnan(look_.rows[left]) ? look_.rows[right] : look_.rows[left];
      if (std::isnan(row)) continue;
      sure_rows_[x] = row;
      const int first = std::max(1, static_cast<int>(std::lround(row - reach)));
      const int last = std::min(response.rows - 2, static_cast<int>(std::lround(row + reach)));
      int best = first;
      for (int y = first; y <= last; ++y)
        if (response(y, x) > response(best, x)) best = y;
      const double snr = response(best, x) / noise;
      if (snr < kLeastSnr || snr > most) continue;
      const float above = response(best - 1, x), here = response(best, x), below = response(best + 1, x);
      const float curvature = 2 * here - above - below;
      const float shift = curvature > 0 ? std::clamp(0.5f * (below - above) / curvature, -0.5f, 0.5f) : 0;
      candidates.add(x, {static_cast<float>(best) + shift, static_cast<float>(known)}, weak);
    }
  }

  /// Median response at the look's path.
  static double typical_snr(const cv::Mat1f& response, const StripeLook& look) {
    std::vector<float> peaks;
    for (std::size_t i = 0; i < look.rows.size(); ++i) {
      if (std::isnan(look.rows[i])) continue;
      const int x = static_cast<int>(i) * look.step + look.step / 2, y = static_cast<int>(std::lround(look.rows[i]));
      float peak = 0;
      for (int k = std::max(0, y - look.step - 1); k <= std::min(response.rows - 1, y + look.step + 1); ++k)
        peak = std::max(peak, response(k, x));
      peaks.push_back(peak);
    }
    return peaks.empty() ? 0.0 : upper_median(peaks);
  }

  /// What is clipped is at least as bright as what surrounds it.
  void fill_clipped(cv::Mat1f& signal) const {
    for (int x = 0; x < signal.cols; ++x)
      for (const ClippedRun& run : clipped_.of(x)) {
        float level = -HUGE_VALF;
        if (run.first > 0) level = signal(run.first - 1, x);
        if (run.last + 1 < signal.rows) level = std::max(level, signal(run.last + 1, x));
        for (int y = run.first; y <= run.last; ++y) signal(y, x) = std::max(signal(y, x), level);
      }
  }

  void count_unused_columns(const RidgeCandidates& candidates, const std::vector<StripeRun>& path) {
    std::vector<bool> used(candidates.columns(), false);
    for (const StripeRun& run : path)
      for (const PathPoint& point : run) used[point.column] = true;
    for (int column = 0; column < candidates.columns(); ++column) {
      if (used[column]) continue;
      ++(candidates.count(column) ? detection_.statistics.low_snr : detection_.statistics.no_peak);
    }
  }

  struct FittedPoint {
    PathPoint point;
    ProfileFit fit;
  };

  std::vector<std::vector<FittedPoint>> fit_points(const std::vector<StripeRun>& path) {
    std::vector<std::vector<FittedPoint>> out;
    double least = 0;
    if (appearance_.noise < kBlurred)
      for (const float weight : appearance_.profile) least += kBand * std::abs(weight);
    for (const StripeRun& run : path) {
      out.emplace_back();
      for (const PathPoint& point : run) {
        const ProfileFit fit = fit_point(point, contrast_);
        const bool sure = std::abs(point.candidate.row - sure_rows_[point.column]) < look_.step + 2 * appearance_.sd_px;
        if (fit.ok && fit.amplitude >= std::max(least, (sure ? kSureProfileSnr : kMinProfileSnr) * fit.amplitude_sigma))
          out.back().push_back({point, fit});
        else
          ++detection_.statistics.low_snr;
      }
    }
    return out;
  }

  /// What most profiles of the image have in common is the stripe's own.
  void measure_shape(const std::vector<std::vector<FittedPoint>>& runs) {
    std::vector<double> widths, skews;
    for (const auto& run : runs)
      for (const FittedPoint& p : run) widths.push_back(p.fit.width_ratio), skews.push_back(p.fit.skewness);
    if (widths.empty()) return;
    typical_width_ = std::max(1.0, upper_median(widths));
    typical_skewness_ = upper_median(skews);
  }

  FittedRun chosen_of(const std::vector<FittedPoint>& run, const RidgeCandidates& candidates) {
    FittedRun out;
    StripeStatistics& statistics = detection_.statistics;
    const StripeParameters& p = parameters_;
    for (const auto& [point, fit] : run) {
      const double width = fit.width_ratio / typical_width_, skewness = std::abs(fit.skewness - typical_skewness_);
      if (width > p.max_width_ratio && fit.width_ratio - typical_width_ > kSignificance * fit.width_sigma) {
        ++statistics.too_wide;
      } else if (skewness > p.max_skew && skewness > kSignificance * fit.skewness_sigma) {
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
    ClippedRun core;     ///< clipped, in the image's rows; empty: none
    bool white = false;  ///< the core is of all channels
  };

  /// `most`: rows beyond the core at most.
  Section cut(const PathPoint& point, int most) {
    int middle = static_cast<int>(std::lround(point.candidate.row)), reach = fitter_.half_window() + 2;
    Section section{0, cores_.at(point.column, point.candidate.row, 1)};
    section.white = section.core.width() >= kWidePlateau;
    if (!section.white) section.core = clipped_.at(point.column, point.candidate.row, 0.5 * reach);
    if (section.core.width() > 0) {
      middle = (section.core.first + section.core.last) / 2;
      reach = std::min(reach, most) + section.core.width() / 2;
    }
    section.first_row = std::max(0, middle - reach);
    fill_values(point.column, section.first_row, std::min(image_.rows - 1, middle + reach),
                section.white              ? faintest_
                : section.core.width() > 0 ? appearance_.light
                                           : appearance_.profile);
    return section;
  }

  void fill_values(int column, int first, int last, const std::array<float, 3>& weights) {
    const int channels = image_.channels();
    const auto at = static_cast<std::ptrdiff_t>(column) * channels;
    const bool dark = !background_.empty();
    values_.clear();
    for (int y = first; y <= last; ++y) {
      const std::uint8_t* const pixel = image_.ptr<std::uint8_t>(y) + at;
      const std::uint8_t* const unlit = dark ? background_.ptr<std::uint8_t>(y) + at : nullptr;
      float value = 0;
      for (int c = 0; c < channels; ++c) value += weights[c] * static_cast<float>(pixel[c] - (unlit ? unlit[c] : 0));
      values_.push_back(value);
    }
  }

  /// Of the pixels that are not clipped, above the mean of two pixels on either side beyond the profile.
  void add_colour(RunPoint& point) const {
    const int channels = image_.channels(), reach = fitter_.half_window();
    const int centre = static_cast<int>(std::lround(point.peak.position));
    const int first = centre - reach, last = centre + reach;
    if (channels < 3 || first < 1 || last + 1 >= image_.rows) return;
    const bool dark = !background_.empty();
    const auto light = [&](int y, int c) {
      const auto at = static_cast<std::ptrdiff_t>(point.peak.column) * channels + c;
      return static_cast<double>(image_.ptr<std::uint8_t>(y)[at] - (dark ? background_.ptr<std::uint8_t>(y)[at] : 0));
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

  ProfileFit fit_point(const PathPoint& point, double contrast) {
    Section section = cut(point, kAll);
    const double start = point.candidate.row - section.first_row;
    ProfileFit fit = section.core.width() > 0 ? fit_clipped(point, section) : fit_values(start, contrast);
    if (section.core.width() == 0 && measure_reflectance(point.column, section.first_row)) {
      // The profile may be cut by the edge of a square: the model that leaves less of it unexplained.
      const ProfileFit cut = fitter_.fit(values_.data(), static_cast<int>(values_.size()), start,
                                         {appearance_.noise, contrast}, reflectance_.data());
      if (cut.ok && (!fit.ok || cut.misfit < kBetter * fit.misfit)) fit = cut;
    }
    fit.position += section.first_row;
    return fit;
  }

  /// Of the surface across the stripe, in `reflectance_`, by the light that is not the laser's. False where it does not
  /// change, or cannot be told.
  bool measure_reflectance(int column, int first_row) {
    const int channels = image_.channels(), n = static_cast<int>(values_.size());
    const auto at = static_cast<std::ptrdiff_t>(column) * channels;
    const bool dark = !background_.empty();
    const cv::Mat& scene = dark ? background_ : image_;
    if (!dark && channels < 3) return false;
    std::array<float, 3> weights = appearance_.light;
    if (!dark) {
      const float along = weights[0] + weights[1] + weights[2];
      for (float& weight : weights) weight = 1 - along * weight;
    }
    const auto light_at = [&](int y) {
      const std::uint8_t* pixel = scene.ptr<std::uint8_t>(std::clamp(y, 0, scene.rows - 1)) + at;
      std::array<float, 3> light{};
      for (int c = 0; c < channels; ++c) light[c] = weights[c] * static_cast<float>(pixel[c]);
      return light;
    };
    reflectance_.resize(n);
    std::array<float, 3> above = light_at(first_row - 1), here = light_at(first_row);
    for (int i = 0; i < n; ++i) {
      const std::array<float, 3> below = light_at(first_row + i + 1);
      float sum = 0;
      for (const float light : above) sum += 0.25f * light;
      for (const float light : here) sum += 0.5f * light;
      for (const float light : below) sum += 0.25f * light;
      reflectance_[i] = sum;
      above = here, here = below;
    }
    const int third = n / 3;
    const float first = std::accumulate(reflectance_.begin(), reflectance_.begin() + third, 0.0f) / third;
    const float last = std::accumulate(reflectance_.end() - third, reflectance_.end(), 0.0f) / third;
    const float top = std::max(first, last);
    if (std::abs(first - last) < kEdge * top || top < 6 * appearance_.noise) return false;
    for (float& share : reflectance_) share = std::max(share / top, kDarkest);
    return true;
  }

  /// By both flanks of a wide plateau, otherwise as if it were not clipped.
  /// A white core is fitted once more, by what lies beside it, where the flanks are too wide to be its own: haze.
  ProfileFit fit_clipped(const PathPoint& point, Section& section) {
    constexpr double kFullWidthOfSd = 2.3548, kHazy = 1.5;  // sd of the flanks in widths of the core
    const auto core = [&] {
      return ClippedRun{section.core.first - section.first_row, section.core.last - section.first_row};
    };
    if (core().width() >= kWidePlateau) {
      const auto plateau = [&] { return fit_plateau(values_, core(), appearance_.noise, background_.empty()); };
      PlateauFit fit = plateau();
      if (section.white && (!fit.profile.ok || fit.sd_px > kHazy * core().width())) {
        section = cut(point, kCoreReach);
        fit = plateau();
      }
      fit.profile.width_ratio = std::min(fit.sd_px, fit.half_height_px / kFullWidthOfSd) / appearance_.sd_px;
      if (fit.profile.ok) return fit.profile;
    }
    return fit_values(0.5 * (core().first + core().last),
                      0);  // a clipped core carries no speckle, and its flanks no more than their share
  }

  /// On some sections that are not clipped. What is off a Gauss is not speckle, though its residuals look alike.
  ContrastScatters scatters_along(const std::vector<StripeRun>& path) {
    constexpr std::size_t kLag = 4, kBlock = 24, kBlocks = 16;
    std::size_t points = 0;
    for (const StripeRun& run : path) points += run.size();
    const std::size_t step = std::max(kBlock, points / kBlocks);
    std::vector<std::vector<PathPoint>> blocks;
    for (const StripeRun& run : path)
      for (std::size_t i = 0; i + 2 * kLag < run.size(); i += step) {
        blocks.emplace_back();
        for (std::size_t k = i; k < std::min(i + kBlock, run.size()); ++k)
          if (cut(run[k], kAll).core.width() == 0) blocks.back().push_back(run[k]);
      }
    ContrastScatters scatters;
    std::vector<double> rows;
    for (std::size_t f = 0; f < ContrastScatters::kContrasts.size(); ++f) {
      for (const std::vector<PathPoint>& block : blocks) {
        rows.clear();
        for (const PathPoint& point : block) {
          const ProfileFit fit = fit_point(point, ContrastScatters::kContrasts[f]);
          rows.push_back(fit.ok ? fit.position : NAN);
        }
        for (std::size_t i = kLag; i + kLag < rows.size(); ++i) {
          const auto column = [&](std::size_t k) { return static_cast<double>(block[k].column); };
          const double share = (column(i) - column(i - kLag)) / (column(i + kLag) - column(i - kLag));
          const double d = rows[i] - (1 - share) * rows[i - kLag] - share * rows[i + kLag];
          if (!std::isnan(d)) scatters.add(f, d * d);
        }
      }
    }
    return scatters;
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
  const StripeLook& look_;
  StripeAppearance appearance_;
  ClippedRuns clipped_;
  std::array<float, 3> faintest_;
  ClippedRuns cores_;
  ProfileFitter fitter_;
  double typical_snr_ = 0;
  double contrast_ = 0;  ///< of speckle
  double typical_width_ = 1, typical_skewness_ = 0;
  mutable std::vector<double> sure_rows_;  ///< of the look's path, by column; NaN where there is none
  std::vector<float> values_, reflectance_;
  StripeDetection detection_;
};

/// `then(detector)` on the image as one whose stripe crosses the columns.
template <class Then>
auto with_detector(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                   const StripeLook& look, Then then) {
  const bool rows = look.orientation == StripeOrientation::kRows;
  const cv::Mat across = rows ? transposed(image) : image;
  const cv::Mat dark = rows ? transposed(background) : background;
  ColumnDetector detector(across, dark, look, parameters);
  return then(detector);
}

/// Whether the look's path is a stripe's. What the scene shows as much of darkly as of brightly is its own.
bool stands_out(const StripeLook& look) {
  constexpr double kLeast = 0.8;  // evidence per column that the path crosses
  return look.evidence > kLeast * look.share * static_cast<double>(look.rows.size());
}

StripeDetection detect(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                       const StripeLook& look) {
  StripeDetection detection;
  if (!background.empty() || stands_out(look)) {
    detection = with_detector(image, background, parameters, look, [](ColumnDetector& d) { return d.detect(); });
  } else {
    detection.statistics.frames = 1;
    detection.statistics.columns =
        static_cast<std::uint64_t>(look.orientation == StripeOrientation::kRows ? image.rows : image.cols);
    detection.statistics.no_peak = detection.statistics.columns;
  }
  detection.orientation = look.orientation;
  return detection;
}

}  // namespace

StripeDetection detect_stripe(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters) {
  check(image, background);
  return detect(image, background, parameters, find_look(image, background, parameters.orientation));
}

StripeDetection detect_stripe(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                              const StripeLook& known) {
  check(image, background);
  return detect(image, background, parameters, follow_look(image, background, known));
}

ContrastScatters measure_contrasts(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                                   const StripeLook& known) {
  check(image, background);
  return with_detector(image, background, parameters, follow_look(image, background, known),
                       [](ColumnDetector& d) { return d.measure_contrasts(); });
}

void ContrastScatters::add(std::size_t contrast, double square) {
  constexpr double kLeast = 1e-4;  // [px^2]
  sums_[contrast] += std::log(square + kLeast);
  ++counts_[contrast];
}

ContrastScatters& ContrastScatters::operator+=(const ContrastScatters& other) {
  for (std::size_t c = 0; c < kContrasts.size(); ++c) sums_[c] += other.sums_[c], counts_[c] += other.counts_[c];
  return *this;
}

double ContrastScatters::best() const {
  constexpr std::size_t kLeast = 20;
  std::size_t best = 0;
  const auto scatter = [&](std::size_t c) { return sums_[c] / static_cast<double>(counts_[c]); };
  for (std::size_t c = 1; c < kContrasts.size(); ++c)
    if (counts_[c] >= kLeast && (counts_[best] < kLeast || scatter(c) < scatter(best))) best = c;
  return kContrasts[best];
}

}  // namespace tankrig
