#include "reconstruction/stripe/paper_stripe.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/input_error.hpp"
#include "reconstruction/stripe/stripe_look.hpp"

namespace tankrig {
namespace {

cv::Mat gate(const cv::Mat& bgr, const PaperStripeParameters& p) {
  cv::Mat hsv;
  if (p.blur) {
    cv::Mat blurred;
    cv::GaussianBlur(bgr, blurred, {5, 5}, 10);
    cv::cvtColor(blurred, hsv, cv::COLOR_BGR2HSV);
  } else {
    cv::cvtColor(bgr, hsv, cv::COLOR_BGR2HSV);
  }
  cv::Mat mask;
  cv::inRange(hsv, cv::Scalar(p.hue_min, p.saturation_min, p.value_min),
              cv::Scalar(p.hue_max, p.saturation_max, p.value_max), mask);
  if (p.morphology) {
    const cv::Mat ellipse = cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5});
    cv::morphologyEx(mask, mask, cv::MORPH_OPEN, ellipse);
    cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, ellipse);
  }
  return mask;
}

int intensity(const cv::Vec3b& pixel) { return pixel[0] + pixel[1] + pixel[2]; }

/// Row of the most intense gated pixel of each column, -1 where the gate let none through.
std::vector<int> brightest_rows(const cv::Mat& bgr, const cv::Mat& mask) {
  std::vector<int> row(bgr.cols, -1), best(bgr.cols, -1);
  for (int y = 0; y < bgr.rows; ++y) {
    const cv::Vec3b* pixels = bgr.ptr<cv::Vec3b>(y);
    const std::uint8_t* passes = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < bgr.cols; ++x) {
      if (!passes[x] || intensity(pixels[x]) <= best[x]) continue;
      best[x] = intensity(pixels[x]);
      row[x] = y;
    }
  }
  return row;
}

StripePeak centre_of_masses(const cv::Mat& bgr, int column, int peak_row, int half_window) {
  const int first = std::max(0, peak_row - half_window), last = std::min(bgr.rows - 1, peak_row + half_window);
  double mass = 0, moment = 0;
  for (int y = first; y <= last; ++y) {
    const double m = intensity(bgr.at<cv::Vec3b>(y, column));
    mass += m;
    moment += m * (y - peak_row);
  }
  const cv::Vec3b& top = bgr.at<cv::Vec3b>(peak_row, column);
  StripePeak peak;
  peak.column = static_cast<float>(column);
  peak.position = static_cast<float>(mass > 0 ? peak_row + moment / mass : peak_row);
  peak.intensity = std::max({top[0], top[1], top[2]}) / 255.0f;
  return peak;
}

}  // namespace

PaperStripeParameters PaperStripeParameters::simulation() {
  PaperStripeParameters p;
  p.hue_min = 33;
  p.hue_max = 118;
  p.saturation_min = 0;
  p.saturation_max = 255;
  p.value_min = 40;
  p.value_max = 255;
  return p;
}

std::string gate_in_words(const PaperStripeParameters& p) {
  return fmt::format("hue {} to {}, saturation {} to {}, value {} to {}", p.hue_min, p.hue_max, p.saturation_min,
                     p.saturation_max, p.value_min, p.value_max);
}

StripeDetection detect_paper(const cv::Mat& image, const PaperStripeParameters& parameters) {
  if (image.type() != CV_8UC3 && image.type() != CV_8UC1)
    throw InputError("stripe: found an image that is not 8 bits with 1 or 3 channels, expected one");
  StripeDetection detection;
  StripeOrientation orientation = parameters.orientation;
  if (orientation == StripeOrientation::kAuto) orientation = find_look(image, {}, orientation).orientation;
  const bool rows = orientation == StripeOrientation::kRows;
  detection.orientation = orientation;
  cv::Mat bgr = image;
  if (rows) cv::transpose(image, bgr);
  if (bgr.channels() == 1) cv::cvtColor(bgr, bgr, cv::COLOR_GRAY2BGR);
  const std::vector<int> brightest = brightest_rows(bgr, gate(bgr, parameters));
  for (int x = 0; x < bgr.cols; ++x)
    if (brightest[x] >= 0) detection.peaks.push_back(centre_of_masses(bgr, x, brightest[x], parameters.half_window));
  StripeStatistics& statistics = detection.statistics;
  statistics.frames = 1;
  statistics.columns = static_cast<std::uint64_t>(bgr.cols);
  statistics.peaks = detection.peaks.size();
  statistics.no_peak = statistics.columns - statistics.peaks;
  return detection;
}

}  // namespace tankrig
