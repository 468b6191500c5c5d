#include "bench/sweep/strip.hpp"

#include <opencv2/imgproc.hpp>

#include "bench/report/canvas.hpp"

namespace tankrig {

cv::Mat view_strip(const std::vector<std::pair<std::string, cv::Mat>>& views, int columns, int width) {
  constexpr int kGap = 4;
  if (views.empty()) return {};
  const cv::Size size(width, views.front().second.rows * width / views.front().second.cols);
  const int count = static_cast<int>(views.size()), rows = (count + columns - 1) / columns;
  cv::Mat sheet(rows * (size.height + kGap) + kGap, std::min(count, columns) * (size.width + kGap) + kGap, CV_8UC3,
                cv::Scalar::all(255));
  for (int i = 0; i < count; ++i) {
    const auto& [caption, view] = views[static_cast<std::size_t>(i)];
    cv::Mat small;
    cv::resize(view, small, size, 0, 0, cv::INTER_AREA);
    if (small.channels() == 1) cv::cvtColor(small, small, cv::COLOR_GRAY2BGR);
    put_boxed_text(small, caption, {10, size.height - 12}, kInk);
    small.copyTo(
        sheet(cv::Rect({kGap + i % columns * (size.width + kGap), kGap + i / columns * (size.height + kGap)}, size)));
  }
  return sheet;
}

}  // namespace tankrig
