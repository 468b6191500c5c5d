#include "bench/report/canvas.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace tankrig {
namespace {

constexpr double kFarAway = -1e30;

Eigen::Matrix3d view_axes(const Viewpoint& view) {
  const Vector3d back = view.towards_viewer.normalized();
  Vector3d right = view.up.cross(back);
  if (right.norm() < 1e-6 * view.up.norm())
    right = Vector3d::UnitX().cross(back).norm() > 0.1 ? Vector3d::UnitX().cross(back) : Vector3d::UnitY().cross(back);
  right.normalize();
  Eigen::Matrix3d axes;
  axes << right.transpose(), back.cross(right).transpose(), back.transpose();
  return axes;
}

Colour scaled(const Colour& c, double factor) {
  Colour out;
  for (int i = 0; i < 3; ++i) out[i] = cv::saturate_cast<uchar>(c[i] * factor);
  return out;
}

cv::Scalar scalar(const Colour& c) { return {double(c[0]), double(c[1]), double(c[2])}; }

void put_box(cv::Mat& picture, const cv::Rect& box) {
  cv::rectangle(picture, box, cv::Scalar::all(255), cv::FILLED);
  cv::rectangle(picture, box, cv::Scalar::all(190), 1, cv::LINE_AA);
}

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapitalHeight = 21;  ///< of the font at scale 1 [px]

}  // namespace

Canvas::Canvas(int width, int height, const Viewpoint& view, const std::vector<Vector3d>& corners)
    : to_view_(view_axes(view)),
      sheet_(height * kSuper, width * kSuper, CV_8UC3),
      depth_(height * kSuper, width * kSuper, CV_64F) {
  sheet_.setTo(cv::Scalar::all(255));  // many times as fast as the same from the constructor
  depth_.setTo(kFarAway);
  Eigen::AlignedBox2d frame;
  for (const Vector3d& corner : corners) frame.extend(Vector2d((to_view_ * corner).head<2>()));
  if (frame.isEmpty()) frame.extend(Vector2d(0, 0));
  middle_ = frame.center();
  const Vector2d size = frame.sizes().cwiseMax(1e-6);
  scale_ = 0.9 * std::min(sheet_.cols / size.x(), sheet_.rows / size.y());
}

Vector3d Canvas::on_sheet(const Vector3d& p) const {
  const Vector3d v = to_view_ * p;
  return {sheet_.cols / 2.0 + (v.x() - middle_.x()) * scale_, sheet_.rows / 2.0 - (v.y() - middle_.y()) * scale_,
          v.z()};
}

void Canvas::put(int x, int y, double z, const Colour& colour) {
  if (x < 0 || y < 0 || x >= sheet_.cols || y >= sheet_.rows) return;
  double& depth = depth_.at<double>(y, x);
  if (z < depth) return;
  depth = z;
  sheet_.at<Colour>(y, x) = colour;
}

void Canvas::triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Colour& colour) {
  const Vector3d p = on_sheet(a), q = on_sheet(b) - p, r = on_sheet(c) - p;
  const double area = q.x() * r.y() - r.x() * q.y();
  if (std::abs(area) < 1e-9) return;
  Vector3d normal = to_view_ * (b - a).cross(c - a).normalized();
  if (normal.z() < 0) normal = -normal;
  const Colour shaded = scaled(colour, 0.8 + 0.2 * std::max(0.0, normal.dot(Vector3d(-0.35, 0.6, 0.72))));
  const int x0 = std::max(0, int(std::ceil(p.x() + std::min({0.0, q.x(), r.x()})))),
            x1 = std::min(sheet_.cols - 1, int(std::floor(p.x() + std::max({0.0, q.x(), r.x()}))));
  const int y0 = std::max(0, int(std::ceil(p.y() + std::min({0.0, q.y(), r.y()})))),
            y1 = std::min(sheet_.rows - 1, int(std::floor(p.y() + std::max({0.0, q.y(), r.y()}))));
  // The shares of q and r in a point of the triangle, by its column and row.
  const Vector2d v = Vector2d(r.y(), -r.x()) / area, w = Vector2d(-q.y(), q.x()) / area;
  for (int y = y0; y <= y1; ++y) {
    const double v_row = v.y() * (y - p.y()), w_row = w.y() * (y - p.y());
    for (int x = x0; x <= x1; ++x) {
      const double of_q = v.x() * (x - p.x()) + v_row, of_r = w.x() * (x - p.x()) + w_row;
      if (of_q >= 0 && of_r >= 0 && of_q + of_r <= 1) put(x, y, p.z() + of_q * q.z() + of_r * r.z(), shaded);
    }
  }
}

void Canvas::line(const Vector3d& a, const Vector3d& b, const Colour& colour, double width_px, double lift) {
  const Vector3d p = on_sheet(a), q = on_sheet(b);
  const int steps = std::max(1, int(std::ceil((q - p).head<2>().norm())));
  const double radius = 0.5 * width_px * kSuper;
  const int reach = int(std::ceil(radius));
  for (int i = 0; i <= steps; ++i) {
    const Vector3d at = p + (q - p) * (double(i) / steps);
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx)
        if (dx * dx + dy * dy <= radius * radius)
          put(int(std::lround(at.x())) + dx, int(std::lround(at.y())) + dy, at.z() + lift, colour);
  }
}

void Canvas::dot(const Vector3d& p, const Colour& colour, double radius_px, double lift) {
  const Vector3d at = on_sheet(p);
  if (!(std::abs(at.x()) < 1e6 && std::abs(at.y()) < 1e6)) return;
  const double radius = radius_px * kSuper;
  for (int y = int(std::ceil(at.y() - radius)); y <= at.y() + radius; ++y)
    for (int x = int(std::ceil(at.x() - radius)); x <= at.x() + radius; ++x)
      if ((Vector2d(x, y) - at.head<2>()).squaredNorm() <= radius * radius) put(x, y, at.z() + lift, colour);
}

cv::Mat Canvas::picture() const {
  cv::Mat out;
  cv::resize(sheet_, out, {}, 1.0 / kSuper, 1.0 / kSuper, cv::INTER_AREA);
  return out;
}

void put_text(cv::Mat& picture, const std::string& text, cv::Point at, const Colour& colour, double height_px) {
  cv::putText(picture, text, at, kFont, height_px / kCapitalHeight, scalar(colour), 1, cv::LINE_AA);
}

void put_boxed_text(cv::Mat& picture, const std::string& text, cv::Point at, const Colour& colour, double height_px) {
  const int height = int(std::lround(height_px)), pad = height / 2;
  put_box(picture, {at.x - pad, at.y - height - pad, text_width(text, height_px) + 2 * pad, height + 2 * pad});
  put_text(picture, text, at, colour, height_px);
}

int text_width(const std::string& text, double height_px) {
  int baseline = 0;
  return cv::getTextSize(text, kFont, height_px / kCapitalHeight, 1, &baseline).width;
}

void put_legend(cv::Mat& picture, const std::vector<LegendEntry>& entries, cv::Point at) {
  constexpr int kLine = 20, kPad = 9, kSquare = 11;
  int width = 0;
  for (const LegendEntry& entry : entries) width = std::max(width, text_width(entry.text));
  const cv::Rect box(at.x, at.y, width + kSquare + 3 * kPad, int(entries.size()) * kLine + kPad);
  put_box(picture, box);
  int y = at.y + kPad;
  for (const LegendEntry& entry : entries) {
    cv::rectangle(picture, {at.x + kPad, y, kSquare, kSquare}, scalar(entry.colour), cv::FILLED);
    put_text(picture, entry.text, {at.x + 2 * kPad + kSquare, y + kSquare}, kInk);
    y += kLine;
  }
}

void put_scale_bar(cv::Mat& picture, double pixels_per_metre, cv::Point at) {
  const double wanted = 0.16 * picture.cols / pixels_per_metre;
  double length = std::pow(10, std::floor(std::log10(wanted)));
  for (const double factor : {5.0, 2.0})
    if (length * factor <= wanted) {
      length *= factor;
      break;
    }
  const int width = int(std::lround(length * pixels_per_metre));
  const std::string label = fmt::format("{} mm", std::lround(length * 1e3));
  put_box(picture, {at.x - 8, at.y - 28, std::max(width, text_width(label)) + 16, 40});
  cv::rectangle(picture, {at.x, at.y - 2, width, 4}, scalar(kInk), cv::FILLED);
  for (const int x : {at.x, at.x + width}) cv::line(picture, {x, at.y - 6}, {x, at.y + 6}, scalar(kInk), 1);
  put_text(picture, label, {at.x, at.y - 12}, kInk);
}

}  // namespace tankrig
