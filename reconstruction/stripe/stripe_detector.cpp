#include "reconstruction/stripe/stripe_detector.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>

#include "core/input_error.hpp"
#include "core/median.hpp"
#include "reconstruction/stripe/appearance.hpp"
#include "reconstruction/stripe/clipped_runs.hpp"
#include "reconstruction/stripe/cut_profile.hpp"
#include "reconstruction/stripe/plateau_fit.hpp"
#include "reconstruction/stripe/profile_fit.hpp"
#include "reconstruction/stripe/ridge_filter.hpp"
#include "reconstruction/stripe/section_colour.hpp"
#include "reconstruction/stripe/stripe_path.hpp"
#include "reconstruction/stripe/stripe_selection.hpp"
#include "reconstruction/stripe/stripe_smoothing.hpp"

namespace tankrig {
namespace {

constexpr double kMinProfileSnr = 3.0;   ///< amplitude over its sigma in the local fit
constexpr double kSureProfileSnr = 1.5;  ///< likewise where the look's path runs
constexpr double kWeakProfileSnr = 0.5;  ///< likewise, of a weak stripe
constexpr int kAll = std::numeric_limits<int>::max();
constexpr int kCoreReach = 10;         ///< [px] to either side of a white core
constexpr double kSkirt = 20;          ///< [DN] of the stripe's colour beside its white core
constexpr int kMostRows = 4;           ///< together
constexpr int kFewRows = 16;           ///< of an image
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
        fitter_(appearance_.sd_px, background.empty()),
        colours_(image, background, appearance_, fitter_.half_window()) {}

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
    const double filter_sd = std::clamp(kFilterOverProfile * appearance_.sd_px, 1.0, 10.0);
    // Among the scene's own lines, or few rows, the evidence is too scarce for that.
    const int most = background_.empty() ? 1 : std::clamp(image_.rows / kFewRows, 1, kMostRows);
    together_ = std::clamp(static_cast<int>(filter_sd / kLeastFilter), 1, most);
    weighted_signal(image_, background_, appearance_.detection, together_, signal);
    fill_clipped(signal);
    const std::vector<float> kernel = ridge_kernel(filter_sd / together_);
    filter_columns(signal, kernel, response);
    constexpr double kQuantisation = 0.3, kCandidateShare = 0.85;
    const double noise = std::max(robust_noise(response), kQuantisation);
    if (background_.empty()) weaken_edges(signal, kernel, response);
    RidgeCandidates candidates(response, noise, kCandidateShare * parameters_.min_snr, together_);
    typical_snr_ = typical_response(response) / noise;
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
    std::vector<StripeRun> path = best_path(candidates, parameters_.min_snr, parameters_.max_step_px, typical_snr_);
    if (is_weak())
      for (StripeRun& run : path) fill_gaps(run);
    return path;
  }

  /// Whether noise hides the stripe in some of its columns.
  bool is_weak() const { return typical_snr_ < 2 * parameters_.min_snr; }

  /// Where the look is sure of the stripe, a run that misses columns goes straight through them.
  void fill_gaps(StripeRun& run) const {
    StripeRun whole;
    for (const PathPoint& point : run) {
      if (!whole.empty()) {
        const PathPoint before = whole.back();
        const auto columns = static_cast<float>(point.column - before.column);
        for (int column = before.column + 1; column < point.column; ++column) {
          if (std::isnan(sure_rows_[column])) continue;
          const float share = static_cast<float>(column - before.column) / columns;
          whole.push_back({column,
                           {(1 - share) * before.candidate.row + share * point.candidate.row,
                            std::min(before.candidate.snr, point.candidate.snr)}});
        }
      }
      whole.push_back(point);
    }
    run = std::move(whole);
  }

  /// Where the look's path is sure of a stripe, what is weaker than the noise lets tell in one column is enough.
  void add_weak(const cv::Mat1f& response, double noise, RidgeCandidates& candidates) const {
    constexpr double kSure = 1.0;  // evidence per column of the reduced image, several times that of noise
    constexpr double kLeastSnr = 1.0;
    // Where the whole stripe is weak among the scene's lines, a column's SNR counts as enough to bear the step to it.
    const bool weak = background_.empty() && is_weak();
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
      const int first = std::max(1, static_cast<int>((row - reach) / together_));
      const int last = std::min(response.rows - 2, static_cast<int>((row + reach) / together_));
      int best = first;
      for (int y = first; y <= last; ++y)
        if (response(y, x) > response(best, x)) best = y;
      const double snr = response(best, x) / noise;
      if (snr < kLeastSnr || snr > most) continue;
      const float above = response(best - 1, x), here = response(best, x), below = response(best + 1, x);
      const float curvature = 2 * here - above - below;
      const float shift = curvature > 0 ? std::clamp(0.5f * (below - above) / curvature, -0.5f, 0.5f) : 0;
      candidates.add(x, {image_row(static_cast<float>(best) + shift, together_), static_cast<float>(known)}, weak);
    }
  }

  /// Median response at the look's path.
  double typical_response(const cv::Mat1f& response) const {
    std::vector<float> peaks;
    for (std::size_t i = 0; i < look_.rows.size(); ++i) {
      if (std::isnan(look_.rows[i])) continue;
      const int x = static_cast<int>(i) * look_.step + look_.step / 2, y = static_cast<int>(std::lround(look_.rows[i]));
      const int first = std::max(0, y - look_.step - 1) / together_;
      const int last = std::min(response.rows - 1, (y + look_.step + 1) / together_);
      float peak = 0;
      for (int k = first; k <= last; ++k) peak = std::max(peak, response(k, x));
      peaks.push_back(peak);
    }
    return peaks.empty() ? 0.0 : upper_median(peaks);
  }

  /// What is clipped is at least as bright as what surrounds it.
  void fill_clipped(cv::Mat1f& signal) const {
    for (int x = 0; x < signal.cols; ++x)
      for (const ClippedRun& run : clipped_.of(x)) {
        const int first = run.first / together_, last = std::min(run.last / together_, signal.rows - 1);
        float level = -HUGE_VALF;
        if (first > 0) level = signal(first - 1, x);
        if (last + 1 < signal.rows) level = std::max(level, signal(last + 1, x));
        for (int y = first; y <= last; ++y) signal(y, x) = std::max(signal(y, x), level);
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
      out.emplace_back().reserve(run.size());
      const std::vector<ProfileFit> fits = fit_all(run, contrast_);
      for (std::size_t i = 0; i < run.size(); ++i) {
        const PathPoint& point = run[i];
        const ProfileFit& fit = fits[i];
        const bool sure = std::abs(point.candidate.row - sure_rows_[point.column]) < look_.step + 2 * appearance_.sd_px;
        const double least_snr = !sure ? kMinProfileSnr : is_weak() ? kWeakProfileSnr : kSureProfileSnr;
        if (fit.ok && fit.amplitude >= std::max(least, least_snr * fit.amplitude_sigma))
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
    out.reserve(run.size());
    StripeStatistics& statistics = detection_.statistics;
    const StripeParameters& p = parameters_;
    for (const auto& [point, fit] : run) {
      const double width = fit.width_ratio / typical_width_, skewness = std::abs(fit.skewness - typical_skewness_);
      if (width > p.max_width_ratio && fit.width_ratio - typical_width_ > kSignificance * fit.width_sigma) {
        ++statistics.too_wide;
      } else if (skewness > p.max_skew && skewness > kSignificance * fit.skewness_sigma) {
        ++statistics.skewed;
      } else if (colours_.has_rival(candidates, point, p)) {
        ++statistics.ambiguous;
      } else {
        out.push_back(
            {peak_of(point.column, fit), fit.amplitude, colours_.at(point.column, fit.position), fit.edge_sigma});
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

  /// Rows on either side of a point where nothing is clipped.
  int section_reach() const { return fitter_.half_window() + 2; }

  /// `most`: rows beyond the core at most.
  Section cut(const PathPoint& point, int most) {
    int middle = static_cast<int>(std::lround(point.candidate.row)), reach = section_reach();
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
    const auto fill = [&](auto value_of) {
      const std::uint8_t* pixel = image_.ptr<std::uint8_t>(first) + at;
      const std::uint8_t* unlit = dark ? background_.ptr<std::uint8_t>(first) + at : nullptr;
      values_.resize(last + 1 - first);
      for (float& value : values_) {
        value = value_of([=](int c) { return weights[c] * static_cast<float>(pixel[c] - (unlit ? unlit[c] : 0)); });
        pixel += image_.step;
        if (unlit) unlit += background_.step;
      }
    };
    if (channels == 1)
      fill([](auto light) { return light(0); });
    else
      fill([](auto light) { return light(0) + light(1) + light(2); });
  }

  ProfileFit fit_values(double start, double contrast) const {
    return fitter_.fit({values_.data(), static_cast<int>(values_.size()), start}, {appearance_.noise, contrast});
  }

  ProfileFit fit_cut_values(double start, double contrast, int starts) const {
    return fit_cut(fitter_, {values_.data(), static_cast<int>(values_.size()), start, reflectance_.data()},
                   {appearance_.noise, contrast}, starts);
  }

  /// Most points are plain; they are fitted together.
  std::vector<ProfileFit> fit_all(const StripeRun& points, double contrast) {
    const std::size_t most = 2 * static_cast<std::size_t>(section_reach()) + 1;
    std::vector<ProfileFit> fits(points.size());
    std::vector<float> values(points.size() * most);
    std::vector<ProfileSection> sections;
    std::vector<std::pair<std::size_t, int>> plain;  // points and the first rows of their sections
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PathPoint& point = points[i];
      Section section = cut(point, kAll);
      const double start = point.candidate.row - section.first_row;
      std::optional<ProfileFit> fit;  // of those that are fitted alone
      if (section.core.width() > 0)
        fit = fit_clipped(point, section);
      else if (crosses_edge(point.column, section))
        fit = better(fit_values(start, contrast), fit_cut_values(start, contrast, 1));
      else if (background_.empty() && image_.channels() == 1)
        fit = fit_unseen_edge(fitter_, values_, start, {appearance_.noise, contrast});
      if (fit) {
        fits[i] = *fit;
        fits[i].position += section.first_row;
        continue;
      }
      float* const kept = values.data() + sections.size() * most;
      std::ranges::copy(values_, kept);
      sections.push_back({kept, static_cast<int>(values_.size()), start});
      plain.emplace_back(i, section.first_row);
    }
    const std::vector<ProfileFit> together = fitter_.fit(sections, {appearance_.noise, contrast});
    for (std::size_t i = 0; i < together.size(); ++i) {
      const auto [point, first_row] = plain[i];
      fits[point] = together[i];
      fits[point].position += first_row;
    }
    return fits;
  }

  /// Whether an edge of the surface's brightness divides the section: then `reflectance_` is that of its values.
  bool crosses_edge(int column, const Section& section) {
    const SectionRows rows{column, section.first_row, static_cast<int>(values_.size()), section.core};
    return measure_reflectance(image_, background_, appearance_, rows, reflectance_);
  }

  static ProfileFit better(const ProfileFit& whole, const ProfileFit& cut) {
    return explains_more(cut, whole) ? cut : whole;
  }

  /// By both flanks of a wide plateau, otherwise as if it were not clipped.
  /// A white core is fitted once more, by what lies beside it, where the flanks are too wide to be its own: haze.
  ProfileFit fit_clipped(const PathPoint& point, Section& section) {
    constexpr double kFullWidthOfSd = 2.3548, kHazy = 1.5;  // sd of the flanks in widths of the core
    const auto core = [&] {
      return ClippedRun{section.core.first - section.first_row, section.core.last - section.first_row};
    };
    if (core().width() >= kWidePlateau) {
      const auto plateau = [&] {
        const auto fit_with = [&](const float* reflectance) {
          return fit_plateau(values_, core(), appearance_.noise, background_.empty(), reflectance);
        };
        const PlateauFit whole = fit_with(nullptr);
        if (!crosses_edge(point.column, section)) return whole;
        const PlateauFit cut = fit_with(reflectance_.data());
        return explains_more(cut.profile, whole.profile) ? cut : whole;
      };
      PlateauFit fit = plateau();
      if (section.white && (!fit.profile.ok || fit.sd_px > kHazy * core().width())) {
        section = cut(point, kCoreReach);
        fit = plateau();
      }
      fit.profile.width_ratio = std::min(fit.sd_px, fit.half_height_px / kFullWidthOfSd) / appearance_.sd_px;
      if (fit.profile.ok) return fit.profile;
    }
    // A clipped core carries no speckle, and its flanks no more than their share.
    const double middle = 0.5 * (core().first + core().last);
    const ProfileFit whole = fit_values(middle, 0);
    if (!crosses_edge(point.column, section)) return whole;
    for (int i = core().first; i <= core().last; ++i)
      values_[i] = reflectance_[i] = 0;  // what is clipped tells nothing
    return better(whole, fit_cut_values(middle, 0, kStartsInTheDark));
  }

  /// On some sections that are not clipped. What is off a Gauss is not speckle, though its residuals look alike.
  ContrastScatters scatters_along(const std::vector<StripeRun>& path) {
    constexpr std::size_t kLag = 4, kBlock = 24, kBlocks = 16;
    std::size_t points = 0;
    for (const StripeRun& run : path) points += run.size();
    const std::size_t step = std::max(kBlock, points / kBlocks);
    std::vector<StripeRun> blocks;
    for (const StripeRun& run : path)
      for (std::size_t i = 0; i + 2 * kLag < run.size(); i += step) {
        blocks.emplace_back();
        for (std::size_t k = i; k < std::min(i + kBlock, run.size()); ++k)
          if (cut(run[k], kAll).core.width() == 0) blocks.back().push_back(run[k]);
      }
    ContrastScatters scatters;
    std::vector<double> rows;
    for (std::size_t f = 0; f < ContrastScatters::kContrasts.size(); ++f) {
      for (const StripeRun& block : blocks) {
        rows.clear();
        for (const ProfileFit& fit : fit_all(block, ContrastScatters::kContrasts[f]))
          rows.push_back(fit.ok ? fit.position : NAN);
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
  SectionColours colours_;
  int together_ = 1;  ///< rows of the image in one of the filter's
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
