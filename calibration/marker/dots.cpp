#include "calibration/marker/dots.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "calibration/visp/visp_methods.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kMostBlobs = 16;
constexpr int kLeastArea_px = 12;
constexpr double kRound = 0.2;    // how far area and box may be from an ellipse's
constexpr double kBeside = 0.03;  // of the layout's size in the picture: a dot's largest distance from its place
constexpr double kAlike = 3;      // a second way to fit that is less than this many times worse

/// Four of the layout of which no three are nearly in a line: those whose smallest triangle is largest.
std::array<std::size_t, 4> corners_of(const std::vector<Vector3d>& p, double& area) {
  std::array<std::size_t, 4> best{0, 1, 2, 3};
  area = 0;
  const auto triangle = [&](std::size_t a, std::size_t b, std::size_t c) {
    return (p[b] - p[a]).cross(p[c] - p[a]).norm() / 2;
  };
  for (std::size_t a = 0; a < p.size(); ++a)
    for (std::size_t b = a + 1; b < p.size(); ++b)
      for (std::size_t c = b + 1; c < p.size(); ++c)
        for (std::size_t d = c + 1; d < p.size(); ++d) {
          const double least = std::min({triangle(a, b, c), triangle(a, b, d), triangle(a, c, d), triangle(b, c, d)});
          if (least > area) area = least, best = {a, b, c, d};
        }
  return best;
}

double extent(const std::vector<Vector2d>& points) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& p : points) box.extend(p);
  return box.diagonal().norm();
}

/// A way to take blobs for the layout's dots.
struct Fit {
  std::vector<std::size_t> blobs;
  double error = std::numeric_limits<double>::infinity();  ///< root mean square, as a share of the picture's extent
};

/// The best way and the next best that differs from it.
std::pair<Fit, Fit> fits_of(const std::vector<Vector2d>& blobs, const std::vector<Vector3d>& layout) {
  double area = 0;
  const std::array<std::size_t, 4> four = corners_of(layout, area);
  const double size = extent(blobs);
  std::array<cv::Point2f, 4> from, to;
  for (std::size_t k = 0; k < 4; ++k)
    from[k] = {static_cast<float>(layout[four[k]].x()), static_cast<float>(layout[four[k]].y())};
  Fit best, next;
  const auto signed_area = [](const std::array<cv::Point2f, 4>& q, int a, int b, int c) {
    return (q[b] - q[a]).cross(q[c] - q[a]);
  };
  const auto consider = [&](const std::array<std::size_t, 4>& chosen) {
    for (std::size_t k = 0; k < 4; ++k)
      to[k] = {static_cast<float>(blobs[chosen[k]].x()), static_cast<float>(blobs[chosen[k]].y())};
    for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{0, 1, 3}, std::array{0, 2, 3}, std::array{1, 2, 3}})
      if (signed_area(from, a, b, c) * signed_area(to, a, b, c) <= 0) return;  // mirrored, or folded
    const cv::Matx33d h = cv::getPerspectiveTransform(from.data(), to.data());
    Fit fit;
    fit.blobs.resize(layout.size());
    fit.error = 0;
    std::vector<bool> used(blobs.size(), false);
    for (std::size_t i = 0; i < layout.size(); ++i) {
      const cv::Vec3d p = h * cv::Vec3d(layout[i].x(), layout[i].y(), 1);
      const Vector2d place(p[0] / p[2], p[1] / p[2]);
      double least = kBeside * size;
      std::size_t nearest = blobs.size();
      for (std::size_t b = 0; b < blobs.size(); ++b)
        if (const double distance = (blobs[b] - place).norm(); !used[b] && distance < least)
          least = distance, nearest = b;
      if (nearest == blobs.size()) return;
      used[nearest] = true;
      fit.blobs[i] = nearest;
      fit.error += least * least / (size * size * static_cast<double>(layout.size()));
    }
    fit.error = std::sqrt(fit.error);
    if (fit.blobs == best.blobs) {
      best.error = std::min(best.error, fit.error);
    } else if (fit.error < best.error) {
      next = best;
      best = fit;
    } else if (fit.error < next.error) {
      next = fit;
    }
  };
  const std::size_t n = blobs.size();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b)
      for (std::size_t c = 0; c < n; ++c)
        for (std::size_t d = 0; d < n; ++d)
          if (a != b && a != c && a != d && b != c && b != d && c != d) consider({a, b, c, d});
  return {best, next};
}

/// Centres of round blobs brighter or darker than their surroundings, by threshold.
std::vector<cv::Point> round_blobs(const cv::Mat& grey, bool bright) {
  cv::Mat binary, labels, statistics, centroids;
  cv::threshold(grey, binary, 0, 255, cv::THRESH_OTSU | (bright ? cv::THRESH_BINARY : cv::THRESH_BINARY_INV));
  const int count = cv::connectedComponentsWithStats(binary, labels, statistics, centroids, 8);
  std::vector<cv::Point> blobs;
  for (int k = 1; k < count && blobs.size() <= kMostBlobs; ++k) {
    const int area = statistics.at<int>(k, cv::CC_STAT_AREA), width = statistics.at<int>(k, cv::CC_STAT_WIDTH),
              height = statistics.at<int>(k, cv::CC_STAT_HEIGHT);
    const int left = statistics.at<int>(k, cv::CC_STAT_LEFT), top = statistics.at<int>(k, cv::CC_STAT_TOP);
    const bool at_edge = left == 0 || top == 0 || left + width == grey.cols || top + height == grey.rows;
    if (area < kLeastArea_px || at_edge || area > grey.rows * grey.cols / 16) continue;
    // A tilted ellipse fills less of its box than an upright one: by its own moments.
    const cv::Moments m = cv::moments(cv::Mat(labels(cv::Rect(left, top, width, height)) == k), true);
    const double xx = m.mu20 / m.m00, yy = m.mu02 / m.m00, xy = m.mu11 / m.m00;
    const double ellipse = 4 * CV_PI * std::sqrt(std::max(0.0, xx * yy - xy * xy));
    if (std::abs(m.m00 / ellipse - 1) > kRound) continue;
    blobs.emplace_back(static_cast<int>(std::lround(centroids.at<double>(k, 0))),
                       static_cast<int>(std::lround(centroids.at<double>(k, 1))));
  }
  return blobs;
}

}  // namespace

void check_layout(const std::vector<Vector3d>& layout) {
  std::vector<Vector2d> flat;
  for (const Vector3d& p : layout) flat.emplace_back(p.x(), p.y());
  double area = 0;
  corners_of(layout, area);
  if (!(area > 0.01 * std::pow(extent(flat), 2)))
    throw InputError("marker: the dots lie in a line but for three, expected four of which no three do");
  // Seen from the front, a layout fits itself; a second way to fit is one that no picture could exclude.
  if (const auto [best, next] = fits_of(flat, layout); std::isfinite(next.error))
    throw InputError(
        fmt::format("marker: the dots can be taken for each other (within {:.1f} % of the layout's size), expected a "
                    "layout that is "
                    "different from every side",
                    100 * next.error));
}

std::vector<Vector2d> find_dots(const cv::Mat& grey, const std::vector<Vector3d>& layout) {
  for (const bool bright : {false, true}) {
    const std::vector<cv::Point> blobs = round_blobs(grey, bright);
    if (blobs.size() < layout.size() || blobs.size() > kMostBlobs) continue;
    const std::vector<Vector2d> centres = visp().dots(grey, blobs);
    if (centres.size() < layout.size()) continue;
    const auto [best, next] = fits_of(centres, layout);
    if (!std::isfinite(best.error) || next.error < kAlike * best.error) continue;
    std::vector<Vector2d> dots;
    for (const std::size_t b : best.blobs) dots.push_back(centres[b]);
    return dots;
  }
  return {};
}

}  // namespace tankrig
