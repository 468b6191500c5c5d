#include "reconstruction/stripe/find/clipped_runs.hpp"

#include <algorithm>

#include "reconstruction/stripe/find/image_rows.hpp"

namespace tankrig {

ClippedRuns::ClippedRuns(const cv::Mat& image, const std::array<float, 3>& weights) : runs_(image.cols) {
  const int channels = image.channels();
  if (std::ranges::none_of(weights, [](float weight) { return weight > 0; })) return;
  const auto value = [&](int y, int x, int c) { return image.ptr<std::uint8_t>(y)[x * channels + c]; };
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y);
    if (!reaches(row, image.cols * channels, kFullScale)) continue;
    for (int i = 0; i < image.cols * channels; ++i) {
      if (row[i] < kFullScale) continue;
      const int x = i / channels, c = i % channels;
      std::vector<ClippedRun>& runs = runs_[x];
      if (!(weights[c] > 0) || (!runs.empty() && runs.back().last >= y && value(runs.back().last, x, c) >= kKnee))
        continue;
      ClippedRun run{y, y};
      while (run.first > 0 && value(run.first - 1, x, c) >= kKnee) --run.first;
      while (run.last + 1 < image.rows && value(run.last + 1, x, c) >= kKnee) ++run.last;
      while (!runs.empty() && runs.back().last + 1 >= run.first) {
        run = {std::min(run.first, runs.back().first), std::max(run.last, runs.back().last)};
        runs.pop_back();
      }
      runs.push_back(run);
    }
  }
}

ClippedRun ClippedRuns::at(int column, double row, double reach) const {
  ClippedRun widest;
  for (const ClippedRun& run : of(column))
    if (run.last >= row - reach && run.first <= row + reach && run.width() > widest.width()) widest = run;
  return widest;
}

}  // namespace tankrig
