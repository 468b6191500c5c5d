#include "apps/tankrig/calibrate/camera_pictures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "bench/report/canvas.hpp"
#include "core/atomic_file.hpp"
#include "session/recording/png_file.hpp"

namespace tankrig::app {
namespace {

constexpr int kWidth = 900, kMargin = 44;  // of a sheet; above the image, for the title

/// A sheet as wide as kWidth with the image's frame on it.
class Sheet {
 public:
  Sheet(const CameraModel& camera, const std::string& title)
      : scale_(double(kWidth) / camera.width),
        picture_(kMargin + static_cast<int>(std::lround(scale_ * camera.height)), kWidth, CV_8UC3,
                 cv::Scalar::all(255)) {
    put_text(picture_, title, {12, 28}, kInk, 11);
  }
  cv::Point at(double u, double v) const {
    return {static_cast<int>(std::lround(scale_ * (u + 0.5))),
            kMargin + static_cast<int>(std::lround(scale_ * (v + 0.5)))};
  }
  cv::Mat& picture() { return picture_; }

 private:
  double scale_;
  cv::Mat picture_;
};

cv::Scalar scalar(const Colour& c) { return {double(c[0]), double(c[1]), double(c[2])}; }

/// Green by way of yellow to red, for 0 to 1.
Colour heat(double share) {
  const double x = std::clamp(share, 0.0, 1.0);
  return {60, static_cast<uchar>(x < 0.5 ? 190 : 190 - 300 * (x - 0.5)),
          static_cast<uchar>(x < 0.5 ? 60 + 360 * x : 240)};
}

}  // namespace

cv::Mat coverage_picture(const IntrinsicsSolution& s) {
  Sheet sheet(s.camera,
              fmt::format("{} corners in {:.0f} % of the image's cells", s.residuals.size(), 100 * s.coverage.share));
  for (int row = 0; row < ImageCoverage::kRows; ++row)
    for (int column = 0; column < ImageCoverage::kColumns; ++column) {
      const double w = double(s.camera.width) / ImageCoverage::kColumns,
                   h = double(s.camera.height) / ImageCoverage::kRows;
      const int corners = s.coverage.corners[static_cast<std::size_t>(row * ImageCoverage::kColumns + column)];
      const cv::Rect cell(sheet.at(column * w, row * h), sheet.at((column + 1) * w, (row + 1) * h));
      cv::rectangle(sheet.picture(), cell, corners == 0 ? cv::Scalar(190, 190, 250) : cv::Scalar(225, 245, 225),
                    cv::FILLED);
      cv::rectangle(sheet.picture(), cell, cv::Scalar::all(200), 1);
      put_text(sheet.picture(), std::to_string(corners), cell.tl() + cv::Point(6, 16), kInk, 8);
    }
  for (const CornerResidual& r : s.residuals)
    cv::circle(sheet.picture(), sheet.at(r.pixel.x(), r.pixel.y()), 2, cv::Scalar(150, 80, 30), cv::FILLED,
               cv::LINE_AA);
  return sheet.picture();
}

cv::Mat residual_picture(const IntrinsicsSolution& s) {
  double largest = 0;
  for (const CornerResidual& r : s.residuals) largest = std::max(largest, r.error.norm());
  // The median error shows as long as a hundredth of the sheet.
  const double enlarged = std::pow(10, std::floor(std::log10(0.02 * s.camera.width / std::max(s.rms, 1e-6))));
  Sheet sheet(s.camera, fmt::format("errors of the corners, {:.0f} times as long: rms {:.3f} px, largest {:.2f} px",
                                    enlarged, s.rms, largest));
  for (const CornerResidual& r : s.residuals) {
    const Vector2d end = r.pixel + enlarged * r.error;
    cv::line(sheet.picture(), sheet.at(r.pixel.x(), r.pixel.y()), sheet.at(end.x(), end.y()),
             scalar(heat(r.error.norm() / (3 * std::max(s.rms, 1e-9)))), 1, cv::LINE_AA);
  }
  return sheet.picture();
}

cv::Mat uncertainty_picture(const IntrinsicsSolution& s, double distance) {
  constexpr double kStep = 1 / 64.0, kWorst = 1;  // of the image's width; px, red
  Sheet sheet(s.camera,
              fmt::format("sigma of a point's pixel, {:.2f} m away: green 0, yellow {:.1f}, red {:.0f} px and more",
                          distance, kWorst / 2, kWorst));
  const ProjectionUncertainty uncertainty(s);
  const double cell = kStep * s.camera.width;
  for (double v = 0; v < s.camera.height; v += cell)
    for (double u = 0; u < s.camera.width; u += cell) {
      const auto at = uncertainty.at({u + cell / 2, v + cell / 2}, distance);
      cv::rectangle(sheet.picture(), cv::Rect(sheet.at(u, v), sheet.at(u + cell, v + cell)),
                    at ? scalar(heat(at->px / kWorst)) : cv::Scalar::all(120), cv::FILLED);
    }
  for (const double x : {0.02, 0.25, 0.5, 0.75, 0.9})
    for (const double y : {0.06, 0.28, 0.5, 0.72, 0.94}) {
      const Vector2d pixel(x * s.camera.width, y * s.camera.height);
      if (const auto at = uncertainty.at(pixel, distance))
        put_boxed_text(sheet.picture(), fmt::format("{:.2f} px {:.2f} mm", at->px, 1e3 * at->metres),
                       sheet.at(pixel.x(), pixel.y()), kInk, 7);
    }
  return sheet.picture();
}

void write_camera_pictures(const std::filesystem::path& folder, const IntrinsicsSolution& s, double distance) {
  std::filesystem::create_directories(folder);
  const auto write = [&](const char* name, const cv::Mat& picture) {
    write_whole_file(folder / name, png_of(picture, folder / name));
  };
  write("coverage.png", coverage_picture(s));
  write("residuals.png", residual_picture(s));
  write("uncertainty.png", uncertainty_picture(s, distance));
}

}  // namespace tankrig::app
