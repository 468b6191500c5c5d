#include "bench/report/preview_picture.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "bench/report/canvas.hpp"
#include "bench/report/stripe_picture.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig {
namespace {

constexpr int kMinWidth = 640, kPanelHeight = 96, kPanelMargin = 10, kHistogramHeight = 76;
const Colour kClipped{255, 0, 255}, kPanel{32, 32, 32}, kBar{80, 200, 80}, kBarBack{70, 70, 70};

cv::Mat grey_of(const cv::Mat& frame) {
  if (frame.channels() == 1) return frame;
  cv::Mat grey;
  cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// One bar per value and channel; heights by square root, so that few pixels show beside many.
void draw_histogram(cv::Mat& panel, const cv::Mat& frame, cv::Point corner) {
  const auto histograms = histograms_of(frame);
  int tallest = 1;
  for (const auto& h : histograms) tallest = std::max(tallest, *std::max_element(h.begin(), h.end()));
  cv::rectangle(panel, cv::Rect(corner.x - 1, corner.y - 1, 258, kHistogramHeight + 2), kBarBack, 1);
  for (std::size_t c = 0; c < histograms.size(); ++c)
    for (int value = 0; value < 256; ++value) {
      const double share = static_cast<double>(histograms[c][static_cast<std::size_t>(value)]) / tallest;
      const int height = static_cast<int>(std::lround(std::sqrt(share) * kHistogramHeight));
      for (int i = 0; i < height; ++i) {
        Colour& pixel = panel.at<Colour>(corner.y + kHistogramHeight - 1 - i, corner.x + value);
        if (histograms.size() == 1)
          pixel = kWhite;
        else
          pixel[static_cast<int>(c)] = 255;
      }
    }
}

void draw_panel(cv::Mat& panel, const cv::Mat& frame, const PreviewMarks& marks) {
  const int histogram_x = panel.cols - 256 - kPanelMargin;
  draw_histogram(panel, frame, {histogram_x, kPanelMargin});
  put_text(panel, marks.caption, {kPanelMargin, 22}, kWhite);

  put_text(panel, fmt::format("focus {:.1f}, best {:.1f}", marks.focus, marks.best_focus), {kPanelMargin, 44}, kWhite);
  const cv::Rect bar(kPanelMargin, 52, histogram_x - 3 * kPanelMargin, 10);
  const double share = marks.best_focus > 0 ? std::clamp(marks.focus / marks.best_focus, 0.0, 1.0) : 0;
  cv::rectangle(panel, bar, kBarBack, cv::FILLED);
  cv::rectangle(panel, cv::Rect(bar.x, bar.y, static_cast<int>(std::lround(share * bar.width)), bar.height), kBar,
                cv::FILLED);

  const int clipped = cv::countNonZero(clipped_mask(frame));
  const std::string share_clipped =
      fmt::format("clipped {:.3f} %", 100.0 * clipped / static_cast<double>(frame.total()));
  put_text(panel, share_clipped, {kPanelMargin, 82}, clipped > 0 ? kClipped : kWhite);
  put_text(panel, marks.laser ? fmt::format("stripe {} points", marks.stripe.size()) : "laser off",
           {kPanelMargin + 190, 82}, kWhite);
}

}  // namespace

double focus_of(const cv::Mat& frame) {
  cv::Mat smooth, laplacian;
  cv::GaussianBlur(grey_of(frame), smooth, cv::Size(3, 3), 0);
  cv::Laplacian(smooth, laplacian, CV_16S, 1);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

cv::Mat1b clipped_mask(const cv::Mat& frame) {
  cv::Mat1b mask = cv::Mat1b::zeros(frame.size());
  std::vector<cv::Mat> channels;
  cv::split(frame, channels);
  for (const cv::Mat& channel : channels) mask |= channel == 255;
  return mask;
}

std::vector<std::array<int, 256>> histograms_of(const cv::Mat& frame) {
  const int channels = frame.channels();
  std::vector<std::array<int, 256>> out(static_cast<std::size_t>(channels));
  for (auto& h : out) h.fill(0);
  for (int row = 0; row < frame.rows; ++row) {
    const unsigned char* pixels = frame.ptr<unsigned char>(row);
    for (int i = 0; i < frame.cols * channels; ++i) ++out[static_cast<std::size_t>(i % channels)][pixels[i]];
  }
  return out;
}

std::vector<Vector2d> stripe_points(const cv::Mat& frame, const cv::Mat& background) {
  const StripeDetection found = detect_stripe(frame, background, {});
  std::vector<Vector2d> out;
  for (const StripePeak& peak : found.peaks)
    out.push_back(found.orientation == StripeOrientation::kRows ? Vector2d(peak.position, peak.column)
                                                                : Vector2d(peak.column, peak.position));
  return out;
}

cv::Mat preview_picture(const cv::Mat& frame, const PreviewMarks& marks) {
  cv::Mat marked;
  if (frame.channels() == 1)
    cv::cvtColor(frame, marked, cv::COLOR_GRAY2BGR);
  else
    marked = frame.clone();
  marked.setTo(kClipped, clipped_mask(frame));
  if (!marks.stripe.empty()) marked = draw_stripe_frame(marked, marks.stripe);
  const int zoom = std::max(1, (kMinWidth + frame.cols - 1) / frame.cols);
  if (zoom > 1) cv::resize(marked, marked, {}, zoom, zoom, cv::INTER_NEAREST);

  cv::Mat picture(marked.rows + kPanelHeight, marked.cols, CV_8UC3, kPanel);
  marked.copyTo(picture.rowRange(0, marked.rows));
  cv::Mat panel = picture.rowRange(marked.rows, picture.rows);
  draw_panel(panel, frame, marks);
  return picture;
}

}  // namespace tankrig
