// Curves over one condition, panel by panel, in the form of the paper's Figures 8 to 10: as SVG and as a picture.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace tankrig {

struct ChartPoint {
  double x = 0, y = 0;
  std::optional<std::array<double, 2>> interval = {};  ///< drawn as a bar
  std::size_t point = 0;                               ///< the configuration that stands for it
};

struct ChartCurve {
  std::string name;                ///< in the legend
  std::vector<ChartPoint> points;  ///< by rising x; those that have a value
};

struct ChartPanel {
  std::string title;
  std::string x_label, y_label;  ///< with units
  std::vector<ChartCurve> curves;
};

/// Panels of one figure share their axes, so that they compare.
struct Chart {
  std::vector<ChartPanel> panels;
  int columns = 2;
};

/// Self-contained, text as text. The dot of a configuration that is `linked` leads to #point-N of the page around it.
std::string chart_svg(const Chart& chart, const std::set<std::size_t>& linked = {});

/// The same, 8-bit BGR.
cv::Mat chart_picture(const Chart& chart);

/// The same for plots_program().
nlohmann::ordered_json chart_json(const Chart& chart, const std::set<std::size_t>& linked);

}  // namespace tankrig
