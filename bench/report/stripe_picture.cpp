#include "bench/report/stripe_picture.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "bench/report/canvas.hpp"

namespace tankrig {
namespace {

const cv::Scalar kMark(60, 40, 255);  ///< red: no laser line is
constexpr int kShift = 6;             ///< fractional bits of OpenCV's drawing

cv::Point fixed_point(double x, double y) {
  return {int(std::lround(x * (1 << kShift))), int(std::lround(y * (1 << kShift)))};
}

Vector2d middle_of(std::vector<Vector2d> stripe, const cv::Size& size) {
  if (stripe.empty()) return {size.width / 2.0, size.height / 2.0};
  Eigen::AlignedBox2d extent;
  for (const Vector2d& p : stripe) extent.extend(p);
  const int along = extent.sizes().x() >= extent.sizes().y() ? 0 : 1;
  const auto half = stripe.begin() + static_cast<std::ptrdiff_t>(stripe.size() / 2);
  std::nth_element(stripe.begin(), half, stripe.end(),
                   [along](const Vector2d& a, const Vector2d& b) { return a[along] < b[along]; });
  return *half;
}

cv::Rect quietest_corner(const std::vector<Vector2d>& stripe, const cv::Size& size, const cv::Size& inset,
                         const cv::Rect& source) {
  constexpr int kDashGap = 10;
  const int right = size.width - inset.width - kDashGap, low = size.height - inset.height - kDashGap;
  const std::array<cv::Point, 4> corners{{{right, low}, {kDashGap, low}, {right, kDashGap}, {kDashGap, kDashGap}}};
  cv::Rect best;
  long fewest = -1;
  for (const cv::Point& corner : corners) {
    const cv::Rect place(corner, inset);
    long hidden = (place & source).area() > 0 ? 1'000'000 : 0;
    for (const Vector2d& p : stripe) hidden += place.contains({int(p.x()), int(p.y())});
    if (fewest < 0 || hidden < fewest) fewest = hidden, best = place;
  }
  return best;
}

}  // namespace

cv::Mat draw_stripe_frame(const cv::Mat& image, const std::vector<Vector2d>& stripe,
                          const StripePictureOptions& options) {
  cv::Mat colour;
  if (image.channels() == 1)
    cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
  else
    colour = image.clone();
  cv::Mat picture = colour.clone();
  for (const Vector2d& p : stripe)
    cv::circle(picture, fixed_point(p.x(), p.y()), (1 << kShift) / 2, kMark, cv::FILLED, cv::LINE_AA, kShift);

  const cv::Size source_size(std::max(1, image.cols * 3 / 8 / options.zoom),
                             std::max(1, image.rows * 3 / 8 / options.zoom));
  const Vector2d middle = middle_of(stripe, image.size());
  const cv::Rect source({std::clamp(int(middle.x()) - source_size.width / 2, 0, image.cols - source_size.width),
                         std::clamp(int(middle.y()) - source_size.height / 2, 0, image.rows - source_size.height)},
                        source_size);
  cv::Mat inset;
  cv::resize(colour(source), inset, source_size * options.zoom, 0, 0, cv::INTER_NEAREST);
  for (const Vector2d& p : stripe) {
    // Pixel centres: the inset's pixel of image position u is (u - source + 0.5) * zoom - 0.5.
    const double x = (p.x() - source.x + 0.5) * options.zoom - 0.5, y = (p.y() - source.y + 0.5) * options.zoom - 0.5;
    cv::circle(inset, fixed_point(x, y), (1 << kShift) * 3 / 2, kMark, cv::FILLED, cv::LINE_AA, kShift);
  }
  const cv::Rect place = quietest_corner(stripe, image.size(), inset.size(), source) & cv::Rect({}, image.size());
  inset(cv::Rect({}, place.size())).copyTo(picture(place));
  cv::rectangle(picture, place, cv::Scalar::all(255), 1);
  cv::rectangle(picture, source, cv::Scalar::all(255), 1);
  put_text(picture, fmt::format("{}x", options.zoom), {place.x + 6, place.y + 16}, kWhite);
  if (!options.title.empty()) put_text(picture, options.title, {10, 20}, kWhite, 11);
  return picture;
}

}  // namespace tankrig
