#include "reconstruction/stripe/find/stripe_trace.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/median.hpp"
#include "reconstruction/stripe/find/ridge_filter.hpp"

namespace tankrig {
namespace {

constexpr double kSkirt = 20;  ///< [DN] of the stripe's colour beside its white core
constexpr int kMostRows = 4;   ///< together
constexpr int kFewRows = 16;   ///< of an image

class Tracer {
 public:
  Tracer(const StripeImage& image, const StripeParameters& parameters) : image_(image), parameters_(parameters) {}

  StripeTrace trace() {
    RidgeCandidates candidates = find_candidates();
    std::vector<StripeRun> runs = best_path(candidates, parameters_.min_snr, parameters_.max_step_px, typical_snr_);
    if (is_weak())
      for (StripeRun& run : runs) fill_gaps(run);
    return {std::move(candidates), std::move(runs), std::move(sure_rows_), is_weak()};
  }

 private:
  RidgeCandidates find_candidates() {
    static thread_local cv::Mat1f signal, response;  // kept from frame to frame: fresh pages cost as much as the filter
    const double filter_sd = std::clamp(kFilterOverProfile * image_.appearance.sd_px, 1.0, 10.0);
    // Among the scene's own lines, or few rows, the evidence is too scarce for that.
    const int most = image_.background.empty() ? 1 : std::clamp(image_.pixels.rows / kFewRows, 1, kMostRows);
    together_ = std::clamp(static_cast<int>(filter_sd / kLeastFilter), 1, most);
    weighted_signal(image_.pixels, image_.background, image_.appearance.detection, together_, signal);
    fill_clipped(signal);
    const std::vector<float> kernel = ridge_kernel(filter_sd / together_);
    filter_columns(signal, kernel, response);
    constexpr double kCandidateShare = 0.85;
    const double noise = std::max(robust_noise(response), kQuantisation);
    if (image_.background.empty()) weaken_edges(signal, kernel, response);
    RidgeCandidates candidates(response, noise, kCandidateShare * parameters_.min_snr, together_);
    typical_snr_ = typical_response(response) / noise;
    find_sure_rows();
    add_weak(response, noise, candidates);
    add_cores(candidates);
    return candidates;
  }

  /// Whether noise hides the stripe in some of its columns.
  bool is_weak() const { return typical_snr_ < 2 * parameters_.min_snr; }

  /// What is clipped is at least as bright as what surrounds it.
  void fill_clipped(cv::Mat1f& signal) const {
    for (int x = 0; x < signal.cols; ++x)
      for (const ClippedRun& run : image_.clipped.of(x)) {
        const int first = run.first / together_, last = std::min(run.last / together_, signal.rows - 1);
        float level = -HUGE_VALF;
        if (first > 0) level = signal(first - 1, x);
        if (last + 1 < signal.rows) level = std::max(level, signal(last + 1, x));
        for (int y = first; y <= last; ++y) signal(y, x) = std::max(signal(y, x), level);
      }
  }

  /// Median response at the look's path.
  double typical_response(const cv::Mat1f& response) const {
    const StripeLook& look = image_.look;
    std::vector<float> peaks;
    for (std::size_t i = 0; i < look.rows.size(); ++i) {
      if (std::isnan(look.rows[i])) continue;
      const int x = static_cast<int>(i) * look.step + look.step / 2, y = static_cast<int>(std::lround(look.rows[i]));
      const int first = std::max(0, y - look.step - 1) / together_;
      const int last = std::min(response.rows - 1, (y + look.step + 1) / together_);
      float peak = 0;
      for (int k = first; k <= last; ++k) peak = std::max(peak, response(k, x));
      peaks.push_back(peak);
    }
    return peaks.empty() ? 0.0 : upper_median(peaks);
  }

  void find_sure_rows() {
    constexpr double kSure = 1.0;  // evidence per column of the reduced image, several times that of noise
    const StripeLook& look = image_.look;
    const int columns = image_.pixels.cols, reduced = static_cast<int>(look.rows.size());
    sure_rows_.assign(columns, NAN);
    if (look.evidence <= kSure * reduced) return;
    for (int x = 0; x < columns; ++x) {
      const double at = static_cast<double>(x) / look.step - 0.5 + 0.5 / look.step;
      const int left = std::clamp(static_cast<int>(std::floor(at)), 0, reduced - 1);
      const int right = std::min(left + 1, reduced - 1);
      const double share = std::clamp(at - left, 0.0, 1.0);
      sure_rows_[x] = (1 - share) * look.rows[left] + share * look.rows[right];
      if (std::isnan(sure_rows_[x])) sure_rows_[x] = std::isnan(look.rows[left]) ? look.rows[right] : look.rows[left];
    }
  }

  /// Where the look's path is sure of a stripe, what is weaker than the noise lets tell in one column is enough.
  void add_weak(const cv::Mat1f& response, double noise, RidgeCandidates& candidates) const {
    constexpr double kLeastSnr = 1.0;
    // Where the whole stripe is weak among the scene's lines, a column's SNR counts as enough to bear the step to it.
    const bool weak = image_.background.empty() && is_weak();
    const double most = (weak ? 1.5 : 1.0) * parameters_.min_snr, known = (weak ? 1.5 : 1.1) * parameters_.min_snr;
    const double reach = image_.look.step + image_.appearance.sd_px;
    for (int x = 0; x < response.cols; ++x) {
      const double row = sure_rows_[x];
      if (std::isnan(row)) continue;
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

  void add_cores(RidgeCandidates& candidates) const {
    if (image_.pixels.channels() < 3) return;
    const double widest = 4 * image_.appearance.sd_px;
    for (int x = 0; x < image_.pixels.cols; ++x)
      for (const ClippedRun& core : image_.cores.of(x))
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
      if (y < 0 || y >= image_.pixels.rows) return 0;
      const cv::Vec3b& pixel = image_.pixels.at<cv::Vec3b>(y, column);
      for (int c = 0; c < 3; ++c) colour += image_.look.weights[c] * pixel[c] / kPixels;
    }
    return colour;
  }

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

  const StripeImage& image_;
  const StripeParameters& parameters_;
  int together_ = 1;  ///< rows of the image in one of the filter's
  double typical_snr_ = 0;
  std::vector<double> sure_rows_;
};

}  // namespace

StripeTrace trace_stripe(const StripeImage& image, const StripeParameters& parameters) {
  return Tracer(image, parameters).trace();
}

}  // namespace tankrig
