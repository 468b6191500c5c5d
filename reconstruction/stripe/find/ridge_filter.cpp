#include "reconstruction/stripe/find/ridge_filter.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "reconstruction/stripe/find/image_rows.hpp"

namespace tankrig {

std::vector<float> ridge_kernel(double sigma_px) {
  const int radius = std::max(2, static_cast<int>(std::ceil(3.2 * sigma_px)));
  std::vector<double> h(radius + 1);
  double sum = 0;
  for (int k = 0; k <= radius; ++k) {
    const double t = k / sigma_px;
    h[k] = (1 - t * t) * std::exp(-0.5 * t * t);
    sum += (k ? 2 : 1) * h[k];
  }
  double norm = 0;
  for (int k = 0; k <= radius; ++k) {
    h[k] -= sum / (2 * radius + 1);
    norm += (k ? 2 : 1) * h[k] * h[k];
  }
  std::vector<float> kernel(radius + 1);
  for (int k = 0; k <= radius; ++k) kernel[k] = static_cast<float>(h[k] / std::sqrt(norm));
  return kernel;
}

void weighted_signal(const cv::Mat& image, const cv::Mat& background, const std::array<float, 3>& weights, int together,
                     cv::Mat1f& signal) {
  signal.create(image.rows / together, image.cols);
  std::array<float, 3> shares = weights;
  for (float& share : shares) share /= std::sqrt(static_cast<float>(together));
  const auto rows = [=](const cv::Mat& from, int y) {
    if (from.empty()) return PixelRows{};
    return PixelRows{from.ptr<std::uint8_t>(y * together), static_cast<std::ptrdiff_t>(from.step)};
  };
  for (int y = 0; y < signal.rows; ++y)
    weigh_pixels(rows(image, y), rows(background, y), together, image.cols, image.channels(), shares.data(), signal[y]);
}

namespace {

/// `then(rows, y, first column, columns)` for every `step`-th row y of the signal, in strips of columns, so that the rows
/// under a filter of that radius stay near and each is read in long pieces; those beyond the border repeat the border.
template <class Then>
void with_rows(const cv::Mat1f& signal, int radius, int step, Then then) {
  constexpr int kStrip = 512;
  std::vector<const float*> rows(signal.rows + 2 * radius);
  for (int x = 0; x < signal.cols; x += kStrip) {
    for (int y = -radius; y < signal.rows + radius; ++y)
      rows[radius + y] = signal[std::clamp(y, 0, signal.rows - 1)] + x;
    for (int y = 0; y < signal.rows; y += step) then(rows.data() + radius + y, y, x, std::min(kStrip, signal.cols - x));
  }
}

}  // namespace

void filter_columns(const cv::Mat1f& signal, const std::vector<float>& kernel, cv::Mat1f& response, int step) {
  response.create((signal.rows + step - 1) / step, signal.cols);
  const int radius = static_cast<int>(kernel.size()) - 1;
  with_rows(signal, radius, step, [&](const float* const* rows, int y, int x, int columns) {
    weigh_rows(rows, kernel.data(), radius, columns, response[y / step] + x);
  });
}

void weaken_edges(const cv::Mat1f& signal, const std::vector<float>& kernel, cv::Mat1f& response) {
  constexpr float kOfWeakerSide = 2;  // an edge's other side says nothing, and both sides of a stripe half
  const int radius = static_cast<int>(kernel.size()) - 1;
  std::vector<float> differences(signal.cols);
  with_rows(signal, radius, 1, [&](const float* const* rows, int y, int x, int columns) {
    weigh_differences(rows, kernel.data(), radius, columns, differences.data());
    weaken(differences.data(), kOfWeakerSide, columns, response[y] + x);
  });
}

std::vector<float> ranked_sizes(const std::vector<float>& values, std::initializer_list<std::size_t> ranks) {
  std::vector<int> sizes;
  sizes.reserve(values.size());
  for (const float value : values) sizes.push_back(std::bit_cast<int>(std::abs(value)));
  std::vector<float> found;
  for (const std::size_t rank : ranks) {
    int size = 0;
    for (int bit = 1 << 30; bit > 0; bit /= 2)
      if (count_below(sizes.data(), static_cast<int>(sizes.size()), size | bit) <= static_cast<int>(rank)) size |= bit;
    found.push_back(std::bit_cast<float>(size));
  }
  return found;
}

double robust_sd(const std::vector<float>& values) {
  return values.empty() ? 0 : kSdOfMedian * ranked_sizes(values, {values.size() / 2})[0];
}

double robust_noise(const cv::Mat1f& response) {
  constexpr int kRowStep = 5, kColumnStep = 7;
  std::vector<float> sample;
  sample.reserve(static_cast<std::size_t>(response.total()) / (kRowStep * kColumnStep) + response.rows + response.cols);
  for (int y = 0; y < response.rows; y += kRowStep)
    for (int x = y % kColumnStep; x < response.cols; x += kColumnStep) sample.push_back(response(y, x));
  return robust_sd(sample);
}

float image_row(float row, int together) { return static_cast<float>(together) * (row + 0.5f) - 0.5f; }

RidgeCandidates::RidgeCandidates(const cv::Mat1f& response, double noise, double min_snr, int together)
    : counts_(response.cols, 0), all_(static_cast<std::size_t>(response.cols) * kPerColumn) {
  constexpr float kRounding = 0.9999f;
  const auto threshold = static_cast<float>(min_snr * noise), scale = static_cast<float>(1 / noise);
  std::vector<int> peaks(response.cols);
  std::vector<float> least(response.cols, threshold);  // of a peak that its column still has a place for
  for (int y = 1; y + 1 < response.rows; ++y) {
    const float *above = response[y - 1], *here = response[y], *below = response[y + 1];
    const int found = find_peaks(above, here, below, least.data(), response.cols, peaks.data());
    for (int i = 0; i < found; ++i) {
      const int x = peaks[i];
      const float slope = below[x] - above[x], shift = 0.5f * slope / (2 * here[x] - above[x] - below[x]);
      const float height = here[x] + (together > 1 ? 0.25f * slope * shift : 0);  // rows apart miss more of the top
      insert(x, {image_row(static_cast<float>(y) + shift, together), scale * height});
      if (together == 1 && count(x) == kPerColumn) least[x] = kRounding * at(x, kPerColumn - 1).snr / scale;
    }
  }
}

void RidgeCandidates::add(int column, const RidgeCandidate& candidate, bool strengthens) {
  RidgeCandidate* list = all_.data() + static_cast<std::size_t>(column) * kPerColumn;
  int& n = counts_[static_cast<std::size_t>(column)];
  RidgeCandidate added = candidate;
  for (int k = 0; k < n; ++k) {
    if (std::abs(list[k].row - candidate.row) > 1) continue;
    if (!strengthens) return;
    added = {list[k].row, std::max(list[k].snr, candidate.snr)};
    std::copy(list + k + 1, list + n--, list + k);
    break;
  }
  insert(column, added);
}

void RidgeCandidates::insert(int column, const RidgeCandidate& candidate) {
  RidgeCandidate* list = all_.data() + static_cast<std::size_t>(column) * kPerColumn;
  int& n = counts_[static_cast<std::size_t>(column)];
  int place = n;
  while (place > 0 && list[place - 1].snr < candidate.snr) --place;
  if (place == kPerColumn) return;
  n = std::min(n + 1, kPerColumn);
  for (int k = n - 1; k > place; --k) list[k] = list[k - 1];
  list[place] = candidate;
}

}  // namespace tankrig
