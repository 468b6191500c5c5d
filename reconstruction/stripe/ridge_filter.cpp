#include "reconstruction/stripe/ridge_filter.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "reconstruction/stripe/image_rows.hpp"

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

void weighted_signal(const cv::Mat& image, const cv::Mat& background, const std::array<float, 3>& weights,
                     cv::Mat1f& signal) {
  signal.create(image.size());
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* dark = background.empty() ? nullptr : background.ptr<std::uint8_t>(y);
    weigh_pixels(image.ptr<std::uint8_t>(y), dark, image.cols, image.channels(), weights.data(), signal[y]);
  }
}

void filter_columns(const cv::Mat1f& signal, const std::vector<float>& kernel, cv::Mat1f& response) {
  response.create(signal.size());
  const int radius = static_cast<int>(kernel.size()) - 1;
  std::vector<const float*> rows(2 * radius + 1);
  for (int y = 0; y < signal.rows; ++y) {
    for (int k = -radius; k <= radius; ++k) rows[radius + k] = signal[std::clamp(y + k, 0, signal.rows - 1)];
    weigh_rows(rows.data() + radius, kernel.data(), radius, signal.cols, response[y]);
  }
}

void weaken_edges(const cv::Mat1f& signal, const std::vector<float>& kernel, cv::Mat1f& response) {
  constexpr float kOfWeakerSide = 2;  // an edge's other side says nothing, and both sides of a stripe half
  const int radius = static_cast<int>(kernel.size()) - 1;
  std::vector<float> difference(signal.cols);
  for (int y = 0; y < signal.rows; ++y) {
    std::ranges::fill(difference, 0.0f);
    for (int k = 1; k <= radius; ++k) {
      const float* above = signal[std::max(y - k, 0)];
      const float* below = signal[std::min(y + k, signal.rows - 1)];
      for (int x = 0; x < signal.cols; ++x) difference[x] += kernel[k] * (above[x] - below[x]);
    }
    float* here = response[y];
    for (int x = 0; x < signal.cols; ++x)
      here[x] = std::min(here[x], kOfWeakerSide * (here[x] - std::abs(difference[x])));
  }
}

namespace {

/// upper_median() of values of which none is negative: those are in the order of their bits, and only what shares the
/// median's first bits is looked at.
float upper_median_of_sizes(const std::vector<float>& sizes) {
  constexpr int kBehind = 21;  // bits that do not tell classes apart: four classes for a doubling of the size
  std::array<std::uint32_t, std::size_t{1} << (32 - kBehind)> counts{};
  const auto class_of = [](float size) { return std::bit_cast<std::uint32_t>(size) >> kBehind; };
  for (const float size : sizes) ++counts[class_of(size)];
  std::size_t rank = sizes.size() / 2;
  std::uint32_t middle = 0;
  while (rank >= counts[middle]) rank -= counts[middle++];
  std::vector<float> alike;
  alike.reserve(counts[middle]);
  for (const float size : sizes)
    if (class_of(size) == middle) alike.push_back(size);
  const auto found = alike.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(alike.begin(), found, alike.end());
  return *found;
}

}  // namespace

double robust_sd(std::vector<float>& values) {
  if (values.empty()) return 0;
  for (float& value : values) value = std::abs(value);
  return 1.4826 * upper_median_of_sizes(values);
}

double robust_noise(const cv::Mat1f& response) {
  constexpr int kRowStep = 5, kColumnStep = 7;
  std::vector<float> sample;
  sample.reserve(static_cast<std::size_t>(response.total()) / (kRowStep * kColumnStep) + response.rows + response.cols);
  for (int y = 0; y < response.rows; y += kRowStep)
    for (int x = y % kColumnStep; x < response.cols; x += kColumnStep) sample.push_back(response(y, x));
  return robust_sd(sample);
}

RidgeCandidates::RidgeCandidates(const cv::Mat1f& response, double noise, double min_snr)
    : counts_(response.cols, 0), all_(static_cast<std::size_t>(response.cols) * kPerColumn) {
  const auto threshold = static_cast<float>(min_snr * noise);
  std::vector<int> peaks(response.cols);
  for (int y = 1; y + 1 < response.rows; ++y) {
    const float* above = response[y - 1];
    const float* here = response[y];
    const float* below = response[y + 1];
    const int found = find_peaks(above, here, below, response.cols, threshold, peaks.data());
    for (int i = 0; i < found; ++i) {
      const int x = peaks[i];
      const float r = here[x];
      const float curvature = 2 * r - above[x] - below[x];
      const float shift = curvature > 0 ? 0.5f * (below[x] - above[x]) / curvature : 0;
      insert(x, {static_cast<float>(y) + std::clamp(shift, -0.5f, 0.5f), static_cast<float>(r / noise)});
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
