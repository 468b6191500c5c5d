#include "rig/safety/beam_check.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <numeric>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr int kStraightest = 3;  // largest bend of a line at a profile

/// Where profiles are taken, and what is a ridge and a line there [px]. However small the picture is, 60 profiles cross
/// its shorter side: triples are counted against one number.
struct Grid {
  int step;      // from profile to profile
  int block;     // summed into a profile's value, along the stripe
  int beside;    // from a ridge to what it is compared with, on either side: the arm's own parts are wider
  int steepest;  // largest step of a line from profile to profile

  explicit Grid(int shorter_side)
      : step(std::min(shorter_side / 60, 8)),
        block(std::min(step, 4)),
        beside(std::min(step + 2, 8)),
        steepest((5 * step + 2) / 4) {}
};

struct Peak {
  int at = 0;
  int height = 0;
};

/// The highest ridge of a profile; `smooth` is scratch of the same length.
Peak highest_ridge(const std::int32_t* profile, int count, int beside, std::int32_t* smooth) {
  for (int i = 1; i + 1 < count; ++i) smooth[i] = profile[i - 1] + profile[i] + profile[i + 1];
  Peak best{0, 0};
  for (int i = beside + 1; i < count - beside - 1; ++i) {
    const int height = smooth[i] - std::max(smooth[i - beside], smooth[i + beside]);
    if (height > best.height) best = {i, height};
  }
  return best;
}

StripeSign sign_of(const std::vector<Peak>& peaks, const Grid& grid, int channels) {
  StripeSign sign;
  std::vector<int> heights;
  for (std::size_t i = 1; i + 1 < peaks.size(); ++i) {
    const Peak &a = peaks[i - 1], &b = peaks[i], &c = peaks[i + 1];
    if (std::min({a.height, b.height, c.height}) <= 0) continue;
    if (std::abs(b.at - a.at) > grid.steepest || std::abs(c.at - b.at) > grid.steepest) continue;
    if (std::abs(c.at - 2 * b.at + a.at) > kStraightest) continue;
    ++sign.triples;
    heights.push_back(b.height);
  }
  if (heights.empty()) return sign;
  sign.contrast = static_cast<double>(upper_median(heights)) / (3 * grid.block * channels);
  return sign;
}

}  // namespace

void DarkReference::add(const cv::Mat& picture) {
  if (sum_.empty() || sum_.size() != picture.size() || sum_.channels() != picture.channels()) {
    sum_ = cv::Mat::zeros(picture.size(), CV_MAKETYPE(CV_32S, picture.channels()));
    count_ = 0;
  }
  cv::add(sum_, picture, sum_, cv::noArray(), CV_32S);
  sum_.convertTo(mean_, CV_8U, 1.0 / ++count_);
}

std::optional<StripeSign> look_for_stripe(const cv::Mat& picture, const cv::Mat& dark) {
  const int rows = picture.rows, cols = picture.cols, channels = picture.channels();
  if (std::min(rows, cols) < StripeSign::kSmallest || picture.size() != dark.size() || picture.type() != dark.type())
    return std::nullopt;
  const Grid grid(std::min(rows, cols));
  const int across = cols / grid.step, along = rows / grid.step, bytes = cols * channels, block = grid.block * channels;
  const auto n = [](int count) { return static_cast<std::size_t>(count); };
  std::vector<std::int16_t> row(n(bytes)), line(n(bytes));
  std::vector<std::int32_t> columns(n(across * rows)), profile(n(cols)), smooth(n(std::max(rows, cols)));
  std::vector<Peak> rows_peaks, columns_peaks;
  for (int r = 0; r < rows; ++r) {
    const std::uint8_t *p = picture.ptr(r), *d = dark.ptr(r);
    for (int i = 0; i < bytes; ++i) row[n(i)] = static_cast<std::int16_t>(p[i] - d[i]);
    for (int b = 0; b < across; ++b) {
      const std::int16_t* at = row.data() + b * grid.step * channels;
      columns[n(b * rows + r)] = std::accumulate(at, at + block, 0);
    }
    const int in_step = r % grid.step;
    if (r / grid.step >= along || in_step >= grid.block) continue;
    if (in_step == 0)
      line = row;
    else
      for (int i = 0; i < bytes; ++i) line[n(i)] = static_cast<std::int16_t>(line[n(i)] + row[n(i)]);
    if (in_step + 1 < grid.block) continue;
    for (int c = 0; c < cols; ++c) {
      const std::int16_t* at = line.data() + c * channels;
      profile[n(c)] = std::accumulate(at, at + channels, 0);
    }
    rows_peaks.push_back(highest_ridge(profile.data(), cols, grid.beside, smooth.data()));
  }
  for (int b = 0; b < across; ++b)
    columns_peaks.push_back(highest_ridge(columns.data() + b * rows, rows, grid.beside, smooth.data()));
  const StripeSign by_columns = sign_of(columns_peaks, grid, channels), by_rows = sign_of(rows_peaks, grid, channels);
  return by_rows.triples > by_columns.triples ? by_rows : by_columns;
}

}  // namespace tankrig
