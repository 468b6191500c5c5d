#include "calibration/marker/square_corners.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/frames.hpp"

namespace tankrig {
namespace {

constexpr double kFirst = 0.06, kLast = 0.94;  // of a side: its ends are rounded
constexpr double kFarOff = 1;                  // px from the parabola: not the edge
constexpr std::size_t kFewest = 8;

double bilinear(const cv::Mat& grey, const Vector2d& at) {
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  if (x < 0 || y < 0 || x + 1 >= grey.cols || y + 1 >= grey.rows) return std::nan("");
  const double u = at.x() - x, v = at.y() - y;
  const auto pixel = [&](int row, int column) { return static_cast<double>(grey.at<uchar>(row, column)); };
  return (1 - v) * ((1 - u) * pixel(y, x) + u * pixel(y, x + 1)) +
         v * ((1 - u) * pixel(y + 1, x) + u * pixel(y + 1, x + 1));
}

/// From a corner to the next, and how far its edge lies outside of that chord.
struct Side {
  Vector2d from, along, outwards;  ///< unit vectors
  double length = 0;
  Vector3d parabola = Vector3d::Zero();  ///< [px] of 1, t, t^2; t: share of the length

  double off(double t) const { return parabola.dot(Vector3d(1, t, t * t)); }
};

/// Where brightness rises most, going outwards: the centre of gravity of its rise.
std::optional<double> edge_at(const cv::Mat& grey, const Side& side, double t, double reach) {
  constexpr double kStep = 0.5;
  const Vector2d middle = side.from + t * side.length * side.along;
  double rise = 0, moment = 0;
  for (double s = -reach; s <= reach; s += kStep) {
    const double g =
        bilinear(grey, middle + (s + kStep) * side.outwards) - bilinear(grey, middle + (s - kStep) * side.outwards);
    if (std::isnan(g)) return std::nullopt;
    rise += std::max(0.0, g), moment += s * std::max(0.0, g);
  }
  return rise > 0 ? std::optional(moment / rise) : std::nullopt;
}

void fit(const cv::Mat& grey, Side& side, double reach) {
  std::vector<Vector2d> edge;  // t, off
  const int samples = std::max(16, static_cast<int>(side.length));
  for (int i = 0; i < samples; ++i) {
    const double t = kFirst + (kLast - kFirst) * (i + 0.5) / samples;
    if (const auto off = edge_at(grey, side, t, reach)) edge.emplace_back(t, *off);
  }
  for (int pass = 0; pass < 2 && edge.size() >= kFewest; ++pass) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (const Vector2d& e : edge) {
      const Vector3d row(1, e.x(), e.x() * e.x());
      normal += row * row.transpose(), right += e.y() * row;
    }
    side.parabola = normal.ldlt().solve(right);
    std::erase_if(edge, [&](const Vector2d& e) { return std::abs(e.y() - side.off(e.x())) > kFarOff; });
  }
  if (edge.size() < kFewest) side.parabola.setZero();
}

/// Where a side ends and the next begins.
Vector2d meeting(const Side& before, const Side& after) {
  Eigen::Matrix2d normals;
  normals << before.outwards.transpose(), after.outwards.transpose();
  Vector2d corner = after.from;
  for (int i = 0; i < 5; ++i) {
    const auto off = [&](const Side& side) {
      return side.outwards.dot(side.from) + side.off(side.along.dot(corner - side.from) / side.length);
    };
    corner = normals.inverse() * Vector2d(off(before), off(after));
  }
  return corner;
}

}  // namespace

void refine_square_corners(const cv::Mat& grey, std::vector<cv::Point2f>& corners) {
  Vector2d middle = Vector2d::Zero();
  for (const cv::Point2f& c : corners) middle += 0.25 * Vector2d(c.x, c.y);
  std::vector<Side> sides;
  for (std::size_t k = 0; k < 4; ++k) {
    const cv::Point2f &a = corners[k], &b = corners[(k + 1) % 4];
    Side side;
    side.from = {a.x, a.y};
    side.length = std::hypot(b.x - a.x, b.y - a.y);
    side.along = (Vector2d(b.x, b.y) - side.from) / side.length;
    side.outwards = {-side.along.y(), side.along.x()};
    if (side.outwards.dot(side.from - middle) < 0) side.outwards *= -1;
    // The frame is an eighth of a side and more: neither the code within nor the next marker is in reach.
    fit(grey, side, std::clamp(side.length / 12, 2.0, 5.0));
    sides.push_back(side);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d corner = meeting(sides[(k + 3) % 4], sides[k]);
    corners[k] = {static_cast<float>(corner.x()), static_cast<float>(corner.y())};
  }
}

}  // namespace tankrig
