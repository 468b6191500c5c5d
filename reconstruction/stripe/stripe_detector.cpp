#include "reconstruction/stripe/stripe_detector.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/input_error.hpp"
#include "core/median.hpp"
#include "reconstruction/stripe/find/stripe_image.hpp"
#include "reconstruction/stripe/find/stripe_trace.hpp"
#include "reconstruction/stripe/fit/one_sided_haze.hpp"
#include "reconstruction/stripe/fit/section_colour.hpp"
#include "reconstruction/stripe/fit/section_fits.hpp"
#include "reconstruction/stripe/runs/sigma_calibration.hpp"
#include "reconstruction/stripe/runs/stripe_selection.hpp"
#include "reconstruction/stripe/runs/stripe_smoothing.hpp"

namespace tankrig {
namespace {

constexpr double kMinProfileSnr = 3.0;   ///< amplitude over its sigma in the local fit
constexpr double kSureProfileSnr = 1.5;  ///< likewise where the look's path runs
constexpr double kWeakProfileSnr = 0.5;  ///< likewise, of a weak stripe
constexpr double kSignificance = 4.0;    ///< sigmas beyond which a shape is not chance
constexpr double kBlurred = 0.5;         ///< [DN] noise that leaves no bands of a smooth light's rounding
constexpr double kBand = 1.5;            ///< [DN] in each channel: more than the height of such a band

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

/// The image as one whose stripe crosses the columns.
StripeImage across_columns(const cv::Mat& image, const cv::Mat& background, const StripeLook& look) {
  if (look.orientation == StripeOrientation::kRows) return {transposed(image), transposed(background), look};
  return {image, background, look};
}

/// One image whose stripe crosses the columns.
class ColumnDetector {
 public:
  ColumnDetector(const StripeImage& image, const StripeParameters& parameters)
      : image_(image),
        parameters_(parameters),
        trace_(trace_stripe(image, parameters)),
        fits_(image),
        colours_(image.pixels, image.background, image.appearance, fits_.half_window()) {}

  StripeDetection detect() {
    StripeStatistics& statistics = detection_.statistics;
    statistics.frames = 1;
    statistics.columns = static_cast<std::uint64_t>(image_.pixels.cols);
    count_unused_columns();
    std::vector<FittedRun> runs;
    const std::vector<std::vector<FittedPoint>> fitted = fit_points();
    measure_shape(fitted);
    const SharedShift shift = measure_haze(fits_, fitted, typical_skewness_);
    statistics.hazy_frames = shift.px != 0;
    for (const auto& run : fitted) runs.push_back(chosen_of(run));
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
        detection_.peaks.back().position += shift.px;
        sigma = std::hypot(sigma, shift.sigma_px);
      }
    }
    statistics.peaks = detection_.peaks.size();
    return std::move(detection_);
  }

 private:
  void count_unused_columns() {
    std::vector<bool> used(trace_.candidates.columns(), false);
    for (const StripeRun& run : trace_.runs)
      for (const PathPoint& point : run) used[point.column] = true;
    for (int column = 0; column < trace_.candidates.columns(); ++column) {
      if (used[column]) continue;
      ++(trace_.candidates.count(column) ? detection_.statistics.low_snr : detection_.statistics.no_peak);
    }
  }

  std::vector<std::vector<FittedPoint>> fit_points() {
    const StripeLook& look = image_.look;
    const StripeAppearance& appearance = image_.appearance;
    fits_.measure_veil(trace_.runs);
    const double contrast = look.contrast ? *look.contrast : scatters_along(trace_.runs, fits_).best();
    double least = 0;
    if (appearance.noise < kBlurred)
      for (const float weight : appearance.profile) least += kBand * std::abs(weight);
    std::vector<std::vector<FittedPoint>> out;
    for (const StripeRun& run : trace_.runs) {
      out.emplace_back().reserve(run.size());
      const std::vector<ProfileFit> fits = fits_.fit(run, contrast);
      for (std::size_t i = 0; i < run.size(); ++i) {
        const PathPoint& point = run[i];
        const ProfileFit& fit = fits[i];
        const bool sure =
            std::abs(point.candidate.row - trace_.sure_rows[point.column]) < look.step + 2 * appearance.sd_px;
        const double least_snr = !sure ? kMinProfileSnr : trace_.weak ? kWeakProfileSnr : kSureProfileSnr;
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

  FittedRun chosen_of(const std::vector<FittedPoint>& run) {
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
      } else if (colours_.has_rival(trace_.candidates, point, p)) {
        ++statistics.ambiguous;
      } else {
        out.push_back(
            {peak_of(point.column, fit), fit.amplitude, colours_.at(point.column, fit.position), fit.edge_sigma});
      }
    }
    return out;
  }

  StripePeak peak_of(int column, const ProfileFit& fit) const {
    const cv::Mat& image = image_.pixels;
    const int row = std::clamp(static_cast<int>(std::lround(fit.position)), 0, image.rows - 1);
    const int channels = image.channels();
    const std::uint8_t* pixel = image.ptr<std::uint8_t>(row) + static_cast<std::ptrdiff_t>(column) * channels;
    StripePeak peak;
    peak.column = static_cast<float>(column);
    peak.position = static_cast<float>(fit.position);
    peak.sigma_px = static_cast<float>(fit.sigma);
    peak.intensity = *std::max_element(pixel, pixel + channels) / 255.0f;
    return peak;
  }

  const StripeImage& image_;
  const StripeParameters& parameters_;
  StripeTrace trace_;
  SectionFits fits_;
  SectionColours colours_;
  double typical_width_ = 1, typical_skewness_ = 0;
  StripeDetection detection_;
};

/// Whether the look's path is a stripe's. What the scene shows as much of darkly as of brightly is its own.
bool stands_out(const StripeLook& look) {
  constexpr double kLeast = 0.8;  // evidence per column that the path crosses
  return look.evidence > kLeast * look.share * static_cast<double>(look.rows.size());
}

StripeDetection detect(const cv::Mat& image, const cv::Mat& background, const StripeParameters& parameters,
                       const StripeLook& look) {
  StripeDetection detection;
  if (!background.empty() || stands_out(look)) {
    detection = ColumnDetector(across_columns(image, background, look), parameters).detect();
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
  const StripeLook look = follow_look(image, background, known);
  const StripeImage across = across_columns(image, background, look);
  SectionFits fits(across);
  const std::vector<StripeRun> runs = trace_stripe(across, parameters).runs;
  fits.measure_veil(runs);
  return scatters_along(runs, fits);
}

}  // namespace tankrig
