// The constant part of a camera's view: the radiance of the lit tank, and the surfaces behind its sub-pixels.
//
// Camera and tank do not move and light is linear, so both are computed once; a frame adds the laser's light.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sim_backends/world/point_spread.hpp"
#include "sim_backends/world/port_rays.hpp"
#include "sim_backends/world/radiometry.hpp"

namespace tankrig::sim {

class AmbientGrid;

/// The surface behind a quarter of a pixel.
struct SubPixel {
  Vector3f p = Vector3f::Constant(1e6f);  ///< w [m]
  float gain = 0;  ///< digital numbers per lux of the laser's light on the surface, before its colour
  std::array<std::int16_t, 3> normal{};  ///< w, unit vector times 32767, towards the camera
};

/// Bounding box of the surfaces behind a cell of 4 x 4 pixels, w [m]; empty (minimum > maximum) where there are none.
struct CellBox {
  Vector3f minimum = Vector3f::Constant(1e6f), maximum = Vector3f::Constant(-1e6f);
};

/// Frames: w, c.
/// Threads: const calls from any.
class CameraView {
 public:
  static constexpr int kSub = 2;                 ///< sub-pixels along a pixel's side
  static constexpr int kCell = 4;                ///< pixels along a cell's side
  static constexpr int kCellSub = kCell * kSub;  ///< sub-pixels along a cell's side

  CameraView(const CameraSpec& spec, const RenderGeometry& geometry, const Radiometry& radiometry);

  int width() const { return spec_.model.width; }
  int height() const { return spec_.model.height; }
  int channels() const { return spec_.channels; }
  const CameraSpec& spec() const { return spec_; }

  /// Digital numbers at light 1, not rounded or clipped; row-major, channels interleaved (blue, green, red or one).
  const float* radiance_row(int v) const {
    return radiance_.data() + static_cast<std::size_t>(v) * width() * channels();
  }

  int cells_x() const { return cells_x_; }
  int cells_y() const { return cells_y_; }
  const CellBox& cell_box(int cell_x, int cell_y) const { return boxes_[cell_y * cells_x_ + cell_x]; }
  /// kCellSub * kCellSub sub-pixels, row by row.
  const SubPixel* cell(int cell_x, int cell_y) const {
    return subs_.data() + static_cast<std::size_t>(cell_y * cells_x_ + cell_x) * kCellSub * kCellSub;
  }

  const Vector3f& centre() const { return centre_; }
  /// Distance along the line of sight to the surface at the middle of pixel (u, v) [m]; large where there is none.
  float range(int u, int v) const { return ranges_[static_cast<std::size_t>(v) * width() + u]; }
  /// A line of sight, w; unit direction. Behind a port it begins where light enters the water.
  struct Sight {
    Vector3f origin, direction;
  };
  /// Through pixel coordinates within the image.
  Sight sight(float u, float v) const;
  /// Four lines of sight, one a row, w; unit directions.
  struct FourSights {
    Eigen::Array<float, 4, 3> origin, direction;
  };
  /// Through the middles of the quarters of pixel column `u`, at row `v`: to the bit those of sight(). The image's edge stands for
  /// what lies beyond it.
  FourSights quarter_sights(int u, float v) const;
  /// Undistorted coordinates (x / z, y / z) of the corner (u - 0.5, v - 0.5), c; behind a port, those in air.
  const Eigen::Vector2f& corner(int u, int v) const {
    return corners_[static_cast<std::size_t>(v) * (width() + 1) + u];
  }
  /// Digital numbers per lux of exitance.
  float scale() const { return scale_; }
  /// The channels' responses to light of this colour, in the order of the image.
  std::array<float, 3> response(const Rgb& colour) const;
  const PixelFilter& laser_filter() const { return laser_filter_; }

 private:
  struct Trace;
  void trace(const RenderGeometry& geometry, const Radiometry& radiometry, Trace& trace);
  void shade(const RenderGeometry& geometry, const Radiometry& radiometry, const Trace& quarters);
  AmbientGrid ambient_grid(const Trace& quarters, const Radiometry& radiometry) const;
  /// The fine samples of a row of quarters.
  void shade_row(const RenderGeometry& geometry, const Radiometry& radiometry, const AmbientGrid& ambient,
                 const Trace& quarters, int y, std::vector<Rgb>& fine) const;
  void filter_row(const PixelFilter& filter, const Rgb* in, float* out) const;
  void filter_columns(const PixelFilter& filter, const std::vector<float>& columns_left);

  CameraSpec spec_;
  Vector3f centre_;
  Eigen::Matrix3f wRc_;
  float scale_;
  PixelFilter laser_filter_;
  int cells_x_, cells_y_;
  std::vector<Eigen::Vector2f> corners_;  ///< undistorted coordinates of the pixels' corners
  std::vector<SubPixel> subs_;
  std::vector<CellBox> boxes_;
  std::vector<float> ranges_, radiance_;
};

/// Digital numbers per lux of exitance of `spec`'s sensor.
float digital_numbers_per_lux(const CameraSpec& spec);

inline CameraView::Sight CameraView::sight(float u, float v) const {
  const float x = std::clamp(u + 0.5f, 0.0f, static_cast<float>(width())),
              y = std::clamp(v + 0.5f, 0.0f, static_cast<float>(height()));
  const int i = std::min(static_cast<int>(x), width() - 1), j = std::min(static_cast<int>(y), height() - 1);
  const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  const Eigen::Vector2f* c = corners_.data() + static_cast<std::size_t>(j) * (width() + 1) + i;
  const Eigen::Vector2f top = c[0] + fx * (c[1] - c[0]);
  const Eigen::Vector2f bottom = c[width() + 1] + fx * (c[width() + 2] - c[width() + 1]);
  const Eigen::Vector2f p = top + fy * (bottom - top);
  const Vector3f direction = Vector3f(p.x(), p.y(), 1).normalized();
  if (!spec_.model.port) return {centre_, wRc_ * direction};
  const PortRay ray = through_port(*spec_.model.port, direction.cast<double>().normalized());
  return {centre_ + wRc_ * ray.origin.cast<float>(), wRc_ * ray.direction.cast<float>()};
}

inline CameraView::FourSights CameraView::quarter_sights(int u, float v) const {
  static const Eigen::Array4f kMiddles(0.125f, 0.375f, 0.625f, 0.875f);
  FourSights four;
  if (spec_.model.port) {
    for (int k = 0; k < 4; ++k) {
      const Sight ray = sight(static_cast<float>(u) + kMiddles[k] - 0.5f, v);
      four.origin.row(k) = ray.origin.array();
      four.direction.row(k) = ray.direction.array();
    }
    return four;
  }
  const float y = std::clamp(v + 0.5f, 0.0f, static_cast<float>(height()));
  const int i = std::clamp(u, 0, width() - 1), j = std::min(static_cast<int>(y), height() - 1);
  const Eigen::Array4f fx = (kMiddles + static_cast<float>(u - i)).max(0.0f).min(1.0f);
  const float fy = y - static_cast<float>(j);
  const Eigen::Vector2f* top = corners_.data() + static_cast<std::size_t>(j) * (width() + 1) + i;
  const Eigen::Vector2f* bottom = top + width() + 1;
  const auto between = [&](int axis) -> Eigen::Array4f {
    const Eigen::Array4f above = top[0][axis] + fx * (top[1][axis] - top[0][axis]);
    return above + fy * (bottom[0][axis] + fx * (bottom[1][axis] - bottom[0][axis]) - above);
  };
  const Eigen::Array4f p = between(0), q = between(1),
                       length = (p * p + (q * q + 1)).unaryExpr([](float square) { return std::sqrt(square); });
  const Eigen::Array4f x = p / length, y_c = q / length, z = 1 / length;
  for (int k = 0; k < 3; ++k) {
    four.origin.col(k).setConstant(centre_[k]);
    four.direction.col(k) = wRc_(k, 0) * x + (wRc_(k, 1) * y_c + wRc_(k, 2) * z);
  }
  return four;
}

}  // namespace tankrig::sim
