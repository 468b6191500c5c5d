#include "reconstruction/stripe/paper_stripe.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/input_error.hpp"
#include "reconstruction/stripe/find/image_rows.hpp"
#include "reconstruction/stripe/find/stripe_look.hpp"
#include "reconstruction/stripe/hsv_gate.hpp"

namespace tankrig {
namespace {

/// What the gate lets through of the picture as it was prepared.
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

/// Row of the most intense pixel of each column that `passes(row, column, pixel)`, -1 where none does. What is as
/// bright as no other pixel of its column is asked first: it mostly passes, and then nothing else can win.
template <class Passes>
std::vector<int> brightest_rows(const cv::Mat& bgr, Passes passes) {
  std::vector<std::int16_t> row(static_cast<std::size_t>(bgr.cols), -1), best(row);
  for (int y = 0; y < bgr.rows; ++y) keep_brighter(bgr.ptr<std::uint8_t>(y), bgr.cols, y, best.data(), row.data());
  std::vector<int> rows(row.begin(), row.end()), refused;
  for (int x = 0; x < bgr.cols; ++x)
    if (!passes(rows[x], x, bgr.ptr<std::uint8_t>(rows[x]) + 3 * x)) refused.push_back(x);
  for (const int x : refused) rows[x] = best[x] = -1;
  for (int y = 0; y < bgr.rows && !refused.empty(); ++y) {
    const std::uint8_t* pixels = bgr.ptr<std::uint8_t>(y);
    for (const int x : refused) {
      const std::uint8_t* pixel = pixels + 3 * x;
      const int here = pixel[0] + pixel[1] + pixel[2];
      if (here <= best[x] || !passes(y, x, pixel)) continue;
      best[x] = static_cast<std::int16_t>(here);
      rows[x] = y;
    }
  }
  return rows;
}

int intensity(const cv::Vec3b& pixel) { return pixel[0] + pixel[1] + pixel[2]; }

std::vector<int> brightest_of(const cv::Mat& bgr, const PaperStripeParameters& p) {
  if (p.blur || p.morphology) {
    const cv::Mat mask = gate(bgr, p);
    return brightest_rows(bgr, [&](int y, int x, const std::uint8_t*) { return mask.ptr<std::uint8_t>(y)[x] != 0; });
  }
  const HsvGate passes({p.hue_min, p.hue_max}, {p.saturation_min, p.saturation_max}, {p.value_min, p.value_max});
  return brightest_rows(bgr, [&](int, int, const std::uint8_t* pixel) { return passes(pixel); });
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
  const std::vector<int> brightest = brightest_of(bgr, parameters);
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
