#include "reconstruction/stripe/find/reduced_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/find/image_rows.hpp"

namespace tankrig {

int reduction_of(const cv::Mat& image) {
  constexpr int kReduced = 320;  // longest side of the reduced image [px]
  constexpr int kMostTogether = 128;
  const int most = std::min({kMostTogether, image.cols, image.rows});
  return std::clamp((std::max(image.cols, image.rows) + kReduced - 1) / kReduced, 1, most);
}

ReducedImage reduce(const cv::Mat& image, const cv::Mat& background) {
  ReducedImage out;
  out.factor = reduction_of(image);
  const int channels = image.channels(), f = out.factor;
  const cv::Size size(image.cols / f, image.rows / f);
  for (int c = 0; c < channels; ++c) {
    out.light.emplace_back(size);
    out.clipped.emplace_back();
  }
  const float share = 1.0f / static_cast<float>(f * f);
  const int columns = size.width * f, bytes = columns * channels;
  const int together = std::clamp(32767 / (255 * f), 1, f);  // rows whose sum over a reduced pixel 16 bits hold
  std::vector<std::int16_t> sums(static_cast<std::size_t>(bytes)), values(sums.size());
  const auto add_groups_of = [&](std::vector<cv::Mat1f>& planes, int y) {
    for (int c = 0; c < channels; ++c)
      add_groups(values.data() + static_cast<std::ptrdiff_t>(c) * columns, size.width, f, share, planes[c][y / f]);
  };
  for (int y = 0; y < size.height * f; ++y) {
    if (y % f == 0)
      for (cv::Mat1f& light : out.light) std::fill_n(light[y / f], size.width, 0.0f);
    const std::uint8_t* in = image.ptr<std::uint8_t>(y);
    const std::uint8_t* dark = background.empty() ? nullptr : background.ptr<std::uint8_t>(y);
    (y % f % together ? add_row : set_row)(in, dark, bytes, sums.data());
    if (y % f % together == together - 1 || y % f == f - 1) {
      split_channels(sums.data(), columns, channels, values.data());
      add_groups_of(out.light, y);
    }
    if (!reaches(in, bytes, kFullScale)) continue;
    mark_channels(in, kFullScale, columns, channels, values.data());
    if (out.clipped[0].empty())
      for (cv::Mat1f& clipped : out.clipped) clipped = cv::Mat1f(size, 0.0f);
    add_groups_of(out.clipped, y);
  }
  return out;
}

ReducedImage transposed(const ReducedImage& in) {
  ReducedImage out;
  out.factor = in.factor;
  for (const cv::Mat1f& m : in.light) out.light.emplace_back(m.t());
  for (const cv::Mat1f& m : in.clipped) out.clipped.push_back(m.empty() ? m : cv::Mat1f(m.t()));
  return out;
}

cv::Mat1f signal_of(const ReducedImage& image, const std::array<float, 3>& weights) {
  constexpr float kShareClipped = 0.2f;
  const int channels = static_cast<int>(image.light.size());
  cv::Mat1f signal(image.light[0].size(), 0.0f);
  for (int c = 0; c < channels; ++c)
    if (weights[c] != 0) signal += weights[c] * image.light[c];
  if (image.clipped[0].empty()) return signal;
  cv::Mat1f clipped(signal.size(), 0.0f);
  for (int c = 0; c < channels; ++c)
    if (weights[c] > 0) clipped = cv::max(clipped, image.clipped[c]);
  for (int x = 0; x < signal.cols; ++x)
    for (int y = 0; y < signal.rows; ++y) {
      if (clipped(y, x) < kShareClipped) continue;
      int end = y;
      while (end < signal.rows && clipped(end, x) >= kShareClipped) ++end;
      float level = -HUGE_VALF;
      for (int k = std::max(0, y - 2); k < y; ++k) level = std::max(level, signal(k, x));
      for (int k = end; k < std::min(signal.rows, end + 2); ++k) level = std::max(level, signal(k, x));
      for (; y < end; ++y) signal(y, x) = std::max(signal(y, x), level);
    }
  return signal;
}

cv::Mat1f sum_of(const ReducedImage& reduced) {
  cv::Mat1f sum = reduced.light[0].clone();
  for (std::size_t c = 1; c < reduced.light.size(); ++c) sum += reduced.light[c];
  return sum;
}

}  // namespace tankrig
