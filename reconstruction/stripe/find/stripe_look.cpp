#include "reconstruction/stripe/find/stripe_look.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/median.hpp"
#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/find/image_rows.hpp"
#include "reconstruction/stripe/find/reduced_image.hpp"
#include "reconstruction/stripe/find/ridge_filter.hpp"
#include "reconstruction/stripe/find/stripe_path.hpp"

namespace tankrig {
namespace {

constexpr double kMinSnr = 3.0, kMaxStep = 1.8;
constexpr int kMinRun = 6;
constexpr double kSigmas[] = {1.0, 2.0, 4.0, 8.0};  ///< of the filters [reduced px]

struct Found {
  double evidence = 0;  ///< for a stripe
  double line = 0;      ///< for a bright line, the scene's or a stripe
  double sigma = 0;     ///< of the filter
  std::vector<StripeRun> path;
};

/// Where the light rises: a stripe adds light, so what is brighter in its colour alone, as the shadow beside it, does not
/// count. `kernel`: filter of both, `edges`: of the scene are in the image.
Found follow_ridges(const cv::Mat1f& signal, const cv::Mat1f& sum, const std::vector<float>& kernel, bool edges) {
  cv::Mat1f response, brightness;
  filter_columns(signal, kernel, response);
  filter_columns(sum, kernel, brightness);
  for (int y = 0; y < response.rows; ++y) keep_lit(brightness[y], response.cols, response[y]);
  const double noise = std::max(robust_noise(response), kQuantisation);
  if (edges) weaken_edges(signal, kernel, response);
  Found found;
  found.path = best_path(RidgeCandidates(response, noise, 0.85 * kMinSnr), kMinSnr, kMaxStep, HUGE_VAL);
  std::erase_if(found.path, [](const StripeRun& run) { return static_cast<int>(run.size()) < kMinRun; });
  for (const StripeRun& run : found.path) {
    found.line -= 3;
    for (const PathPoint& point : run) found.line += std::log(point.candidate.snr / static_cast<float>(kMinSnr));
  }
  return found;
}

/// `scene`: its own light is in the image, too. Its lines are dark as often as they are bright, and the laser only adds
/// light: what speaks for a dark stripe as well speaks for none.
Found follow(const cv::Mat1f& signal, const cv::Mat1f& sum, double sigma, bool scene) {
  const std::vector<float> kernel = ridge_kernel(sigma);
  Found found = follow_ridges(signal, sum, kernel, scene);
  found.evidence = found.line;
  found.sigma = sigma;
  if (scene) found.evidence -= follow_ridges(-signal, -sum, kernel, scene).line;
  return found;
}

/// Over all widths: the clearest line among those that are clearly a stripe.
Found clearest_width(const cv::Mat1f& signal, const cv::Mat1f& sum, bool scene) {
  constexpr double kWider = 0.94;  // of two widths that answer alike, the smaller: haze is wide, too
  constexpr double kClear = 0.6;   // of the most evidence
  std::vector<Found> all;
  double most = 0;
  for (const double sigma : kSigmas) {
    all.push_back(follow(signal, sum, sigma, scene));
    const double share = std::pow(kWider, std::log2(sigma));
    all.back().line *= share, all.back().evidence *= share;
    most = std::max(most, all.back().evidence);
  }
  std::erase_if(all, [&](const Found& found) { return found.evidence < kClear * most; });
  return all.empty() ? Found{} : *std::ranges::max_element(all, {}, &Found::line);
}

std::vector<std::array<float, 3>> colours(int channels, bool dark) {
  if (channels == 1) return {{1, 0, 0}};
  const auto r = static_cast<float>(1 / std::sqrt(3.0));
  if (dark) return {{r, r, r}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const float m = static_cast<float>(1 / std::sqrt(1.5)), h = -0.5f * m;
  return {{r, r, r}, {m, h, h}, {h, m, h}, {h, h, m}};
}

/// Sets the path, in pixels of the image.
void set_path(const Found& found, const ReducedImage& reduced, StripeLook& look) {
  const int columns = reduced.light[0].cols;
  look.evidence = found.evidence;
  look.step = reduced.factor;
  look.share = 0;
  look.rows.assign(columns, NAN);
  for (const StripeRun& run : found.path)
    for (const PathPoint& point : run) {
      look.rows[point.column] = static_cast<float>((point.candidate.row + 0.5) * look.step - 0.5);
      look.share += 1.0 / columns;
    }
}

/// Of each column of responses the strongest place, if it is far above the noise and no other place is half as strong;
/// NaN elsewhere. `sd`: of the stripe, in rows of the responses.
std::vector<float> clear_peaks(const cv::Mat1f& response, double noise, double sd) {
  constexpr double kClear = 12, kApart = 4;  // the last in sd
  constexpr float kRival = 0.5;
  const int columns = response.cols, apart = static_cast<int>(kApart * sd + 2);
  std::vector<float> most(response[0], response[0] + columns), rival, peaks;
  std::vector<int> best(columns, 0), rivals(columns, 0);
  for (int y = 1; y < response.rows; ++y) keep_larger(response[y], columns, y, most.data(), best.data());
  for (const float height : most) rival.push_back(kRival * height);
  for (int y = 0; y < response.rows; ++y)
    count_rivals(response[y], rival.data(), best.data(), y, apart, columns, rivals.data());
  for (int x = 0; x < columns; ++x) {
    const int y = best[x];
    const bool inside = y > 0 && y + 1 < response.rows, clear = inside && most[x] >= kClear * noise && rivals[x] == 0;
    const float above = clear ? response(y - 1, x) : NAN, below = clear ? response(y + 1, x) : NAN;
    peaks.push_back(static_cast<float>(y) + 0.5f * (below - above) / (2 * most[x] - above - below));
  }
  return peaks;
}

/// Where the stripe is beyond doubt in nearly all of some columns, they are enough: the look has their rows alone, and no
/// evidence for weak points between them. Only with a dark image, and of a stripe that crosses the columns.
std::optional<StripeLook> clear_look(const cv::Mat& image, const cv::Mat& background, const StripeLook& known) {
  constexpr int kColumns = 48, kPadded = 64;  // from as many on the filter is fast
  constexpr double kNearlyAll = 0.95;
  if (background.empty() || known.orientation == StripeOrientation::kRows) return std::nullopt;
  const double filter_sd = std::max(kSigmas[0], kFilterOverProfile * known.sd_px);
  const int row_step = std::max(1, static_cast<int>(filter_sd / kLeastFilter));
  if (image.rows < 3 * row_step) return std::nullopt;
  const int channels = image.channels(), factor = reduction_of(image), reduced_columns = image.cols / factor;
  const int step = std::max(1, reduced_columns / kColumns);
  std::vector<int> sampled, columns;  // reduced ones, and their middles in the image
  for (int i = step / 2; i < reduced_columns; i += step) {
    sampled.push_back(i);
    columns.push_back(i * factor + factor / 2);
  }
  columns.resize(std::max<std::size_t>(kPadded, columns.size()), columns.back());
  cv::Mat1f signal, response;
  weighted_signal(sampled_columns(image, columns, row_step), sampled_columns(background, columns, row_step),
                  known.weights, 1, signal);
  filter_columns(signal, ridge_kernel(filter_sd / row_step), response);
  response = response.colRange(0, static_cast<int>(sampled.size()));
  const double noise = std::max(robust_noise(response), kQuantisation);
  const std::vector<float> peaks = clear_peaks(response, noise, known.sd_px / row_step);
  StripeLook look = known;
  look.evidence = look.share = 0;
  look.step = factor;
  look.rows.assign(reduced_columns, NAN);
  std::size_t clear = 0;
  for (std::size_t k = 0; k < sampled.size(); ++k) {
    if (std::isnan(peaks[k])) continue;
    const float row = static_cast<float>(row_step) * peaks[k];
    const std::uint8_t* pixel = image.ptr<std::uint8_t>(static_cast<int>(std::lround(row)), columns[k]);
    if (reaches(pixel, channels, kFullScale)) continue;
    look.rows[sampled[k]] = row;
    ++clear;
  }
  if (static_cast<double>(clear) < kNearlyAll * static_cast<double>(sampled.size())) return std::nullopt;
  return look;
}

}  // namespace

StripeLook find_look(const cv::Mat& image, const cv::Mat& background, StripeOrientation orientation) {
  constexpr double kGreyShare = 0.4;  // bright ridges are everywhere, coloured ones are not
  const ReducedImage as_is = reduce(image, background);
  const int channels = image.channels();
  StripeLook best;
  double evidence[2] = {0, 0};
  for (const bool rows : {false, true}) {
    if (orientation != StripeOrientation::kAuto && rows != (orientation == StripeOrientation::kRows)) continue;
    const ReducedImage reduced = rows ? transposed(as_is) : as_is;
    const cv::Mat1f sum = sum_of(reduced);
    for (const auto& weights : colours(channels, !background.empty())) {
      const cv::Mat1f signal = signal_of(reduced, weights);
      const bool grey = channels == 3 && weights[0] == weights[1] && weights[1] == weights[2];
      Found found = clearest_width(signal, sum, background.empty());
      if (grey && background.empty()) found.evidence *= kGreyShare;
      if (found.evidence <= evidence[rows]) continue;
      evidence[rows] = found.evidence;
      if (found.evidence <= best.evidence) continue;
      best.orientation = rows ? StripeOrientation::kRows : StripeOrientation::kColumns;
      best.weights = weights;
      best.sd_px = found.sigma * reduced.factor / kFilterOverProfile;
      set_path(found, reduced, best);
    }
  }
  best.rival = std::min(evidence[0], evidence[1]);
  return best;
}

StripeLook follow_look(const cv::Mat& image, const cv::Mat& background, const StripeLook& known) {
  if (auto clear = clear_look(image, background, known)) return *clear;
  const bool rows = known.orientation == StripeOrientation::kRows;
  const ReducedImage as_is = reduce(image, background);
  const ReducedImage reduced = rows ? transposed(as_is) : as_is;
  StripeLook look = known;
  const double sigma = std::max(kSigmas[0], kFilterOverProfile * known.sd_px / reduced.factor);
  set_path(follow(signal_of(reduced, known.weights), sum_of(reduced), sigma, background.empty()), reduced, look);
  return look;
}

}  // namespace tankrig
