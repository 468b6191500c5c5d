// A white sheet to draw on from three dimensions: orthographic, z-buffered, antialiased by drawing at three times the size.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Blue, green, red of the sheet's colours.
using Colour = cv::Vec3b;

/// From where one looks.
/// Frames: whatever the drawn things are in.
struct Viewpoint {
  Vector3d towards_viewer{1, -1, 1};  ///< any length
  Vector3d up{0, 0, 1};               ///< what is up on the sheet; another is taken if parallel to the line of sight
};

/// Draws triangles, lines and dots seen from a Viewpoint, then text and a legend on top.
/// Units: metres for what is drawn, final pixels for widths and text.
class Canvas {
 public:
  /// Frames `corners` (the points that must be visible) with a margin.
  Canvas(int width, int height, const Viewpoint& view, const std::vector<Vector3d>& corners);

  /// Shaded by how much the surface faces the viewer and a lamp at the upper left.
  void triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Colour& colour);
  /// `lift` [m] brings it towards the viewer, so that it shows on the surface it lies on.
  void line(const Vector3d& a, const Vector3d& b, const Colour& colour, double width_px, double lift);
  void dot(const Vector3d& p, const Colour& colour, double radius_px, double lift);

  double pixels_per_metre() const { return scale_ / kSuper; }

  /// The finished picture, 8-bit BGR.
  cv::Mat picture() const;

 private:
  static constexpr int kSuper = 3;
  /// x, y on the oversized sheet, z towards the viewer [m].
  Vector3d on_sheet(const Vector3d& p) const;
  void put(int x, int y, double z, const Colour& colour);

  Eigen::Matrix3d to_view_;  ///< rows: right, up, towards the viewer
  double scale_ = 1;         ///< oversized pixels per metre
  Vector2d middle_ = Vector2d::Zero();
  cv::Mat sheet_;  ///< BGR, oversized
  cv::Mat depth_;  ///< double, towards the viewer
};

struct LegendEntry {
  Colour colour;
  std::string text;
};

inline const Colour kWhite{255, 255, 255};
inline const Colour kInk{40, 40, 40};

/// Antialiased text; `at` is its left baseline. `height_px` is the height of a capital letter.
void put_text(cv::Mat& picture, const std::string& text, cv::Point at, const Colour& colour, double height_px = 10);
/// The same on a box of its own, to be read whatever lies behind it.
void put_boxed_text(cv::Mat& picture, const std::string& text, cv::Point at, const Colour& colour,
                    double height_px = 10);
int text_width(const std::string& text, double height_px = 10);

/// A boxed list of coloured squares with their meaning, its top left corner at `at`.
void put_legend(cv::Mat& picture, const std::vector<LegendEntry>& entries, cv::Point at);

/// A bar of a round length with its label, boxed, its left end at `at`.
void put_scale_bar(cv::Mat& picture, double pixels_per_metre, cv::Point at);

}  // namespace tankrig
