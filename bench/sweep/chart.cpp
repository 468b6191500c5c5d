#include "bench/sweep/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "bench/report/canvas.hpp"

using nlohmann::ordered_json;

namespace tankrig {
namespace {

constexpr int kWidth = 490, kHeight = 330;  // of a panel
constexpr int kFromLeft = 62, kFromRight = 126, kFromTop = 34,
              kFromBottom = 52;                                        // its margins; the legend is at the right
constexpr std::array<std::array<int, 3>, 8> kColours{{{31, 119, 180},  // red, green, blue
                                                      {255, 127, 14},
                                                      {44, 160, 44},
                                                      {214, 39, 40},
                                                      {148, 103, 189},
                                                      {140, 86, 75},
                                                      {227, 119, 194},
                                                      {90, 90, 90}}};

std::string link_to(std::size_t point) { return fmt::format("#point-{}", point); }

/// Where a panel's parts go; either of the two ways to draw them.
class Sheet {
 public:
  enum class Align { kLeft, kMiddle, kRight };
  virtual ~Sheet() = default;
  virtual void line(const std::vector<cv::Point2d>& points, const std::array<int, 3>& colour, double width) = 0;
  virtual void dot(const cv::Point2d& at, const std::array<int, 3>& colour, const ChartPoint& point) = 0;
  virtual void text(const std::string& text, const cv::Point2d& at, Align align, bool upwards) = 0;
};

class SvgSheet final : public Sheet {
 public:
  SvgSheet(int width, int height, const std::set<std::size_t>& linked)
      : linked_(linked),
        text_(fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
            "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
            "fill=\"white\"/>\n",
            width, height)) {}
  void line(const std::vector<cv::Point2d>& points, const std::array<int, 3>& colour, double width) override {
    text_ += "<polyline fill=\"none\" points=\"";
    for (const cv::Point2d& p : points) text_ += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
    text_ += fmt::format("\" stroke=\"rgb({},{},{})\" stroke-width=\"{}\"/>\n", colour[0], colour[1], colour[2], width);
  }
  void dot(const cv::Point2d& at, const std::array<int, 3>& colour, const ChartPoint& point) override {
    const bool link = linked_.contains(point.point);
    if (link) text_ += fmt::format("<a href=\"{}\">", link_to(point.point));
    text_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.4\" fill=\"rgb({},{},{})\"", at.x, at.y, colour[0],
                         colour[1], colour[2]);
    text_ += link ? " stroke=\"transparent\" stroke-width=\"9\"/></a>\n" : "/>\n";  // easier to hit
  }
  void text(const std::string& text, const cv::Point2d& at, Align align, bool upwards) override {
    static constexpr const char* kAnchors[] = {"start", "middle", "end"};
    text_ += fmt::format("<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"{2}\"", at.x, at.y,
                         kAnchors[static_cast<int>(align)]);
    if (upwards) text_ += fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", at.x, at.y);
    text_ += ">";
    for (const char c : text) text_ += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '>' ? "&gt;" : std::string(1, c);
    text_ += "</text>\n";
  }
  std::string finished() const { return text_ + "</svg>\n"; }

 private:
  const std::set<std::size_t>& linked_;
  std::string text_;
};

class PictureSheet final : public Sheet {
 public:
  PictureSheet(int width, int height) : picture_(height * kScale, width * kScale, CV_8UC3, cv::Scalar::all(255)) {}
  void line(const std::vector<cv::Point2d>& points, const std::array<int, 3>& colour, double width) override {
    std::vector<cv::Point> scaled;
    for (const cv::Point2d& p : points) scaled.push_back(on_sheet(p));
    cv::polylines(picture_, scaled, false, bgr(colour), std::max(1, static_cast<int>(std::lround(width * kScale))),
                  cv::LINE_AA);
  }
  void dot(const cv::Point2d& at, const std::array<int, 3>& colour, const ChartPoint&) override {
    cv::circle(picture_, on_sheet(at), static_cast<int>(2.4 * kScale), bgr(colour), cv::FILLED, cv::LINE_AA);
  }
  void text(const std::string& text, const cv::Point2d& at, Align align, bool upwards) override {
    const double height = 9 * kScale;
    const int width = text_width(text, height);
    const double share = align == Align::kLeft ? 0 : align == Align::kMiddle ? 0.5 : 1;
    if (!upwards) {
      put_text(picture_, text, on_sheet(at) - cv::Point(static_cast<int>(share * width), 0), ink(), height);
      return;
    }
    cv::Mat flat(static_cast<int>(2 * height), width + 4, CV_8UC3, cv::Scalar::all(255)), turned;
    put_text(flat, text, {2, static_cast<int>(1.5 * height)}, ink(), height);
    cv::rotate(flat, turned, cv::ROTATE_90_COUNTERCLOCKWISE);
    const cv::Point corner = on_sheet(at) - cv::Point(static_cast<int>(1.5 * height), static_cast<int>(share * width));
    const cv::Rect place = cv::Rect(corner, turned.size()) & cv::Rect({}, picture_.size());
    turned(cv::Rect(place.tl() - corner, place.size())).copyTo(picture_(place));
  }
  cv::Mat finished() const { return picture_; }

 private:
  static constexpr int kScale = 2;
  static cv::Scalar bgr(const std::array<int, 3>& c) { return cv::Scalar(c[2], c[1], c[0]); }
  static Colour ink() { return kInk; }
  static cv::Point on_sheet(const cv::Point2d& p) {
    return {static_cast<int>(std::lround(p.x * kScale)), static_cast<int>(std::lround(p.y * kScale))};
  }
  cv::Mat picture_;
};

struct Axis {
  double low = 0, high = 1, step = 0.2;

  double share(double value) const { return (value - low) / (high - low); }
  std::vector<double> ticks() const {
    std::vector<double> out;
    for (int i = 0; low + i * step <= high + 1e-9 * step; ++i) out.push_back(low + i * step);
    return out;
  }
};

/// From 0 to the next tick above `high`, five ticks or so; from `low` if that is negative or most of the axis would be empty.
Axis axis_of(double low, double high) {
  if (!(high > low)) high = low + 1;
  const double from = low > high / 2 && low < high ? low : std::min(0.0, low);
  const double rough = (high - from) / 5, power = std::pow(10, std::floor(std::log10(rough)));
  const double rest = rough / power;
  const double step = (rest <= 1 ? 1 : rest <= 2 ? 2 : rest <= 5 ? 5 : 10) * power;
  return {std::floor(from / step + 1e-9) * step, std::ceil(high / step - 1e-9) * step, step};
}

std::string tick_text(double value, double step) {
  const int digits = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  return fmt::format("{:.{}f}", std::abs(value) < 1e-12 ? 0.0 : value, digits);
}

/// Those of all panels.
std::pair<Axis, Axis> axes_of(const Chart& chart) {
  double x_low = HUGE_VAL, x_high = 0, y_low = 0, y_high = 0;
  for (const ChartPanel& panel : chart.panels)
    for (const ChartCurve& curve : panel.curves)
      for (const ChartPoint& p : curve.points) {
        x_low = std::min(x_low, p.x), x_high = std::max(x_high, p.x);
        y_low = std::min(y_low, p.y), y_high = std::max({y_high, p.y, p.interval ? (*p.interval)[1] : 0.0});
      }
  return {axis_of(std::min(x_low, x_high), x_high), axis_of(y_low, y_high)};
}

void draw(Sheet& sheet, const Chart& chart) {
  const auto [x, y] = axes_of(chart);
  const std::array<int, 3> black{40, 40, 40}, grey{225, 225, 225};
  for (std::size_t k = 0; k < chart.panels.size(); ++k) {
    const ChartPanel& panel = chart.panels[k];
    const double left = static_cast<double>(k % chart.columns) * kWidth + kFromLeft;
    const double top = static_cast<double>(k / chart.columns) * kHeight + kFromTop;
    const double width = kWidth - kFromLeft - kFromRight, height = kHeight - kFromTop - kFromBottom;
    const auto at = [&, x = x, y = y](double vx, double vy) {
      return cv::Point2d(left + width * x.share(vx), top + height * (1 - y.share(vy)));
    };
    for (const double tick : y.ticks()) {
      sheet.line({at(x.low, tick), at(x.high, tick)}, grey, 1);
      sheet.text(tick_text(tick, y.step), at(x.low, tick) + cv::Point2d(-6, 4), Sheet::Align::kRight, false);
    }
    for (const double tick : x.ticks()) {
      sheet.line({at(tick, y.low), at(tick, y.low) + cv::Point2d(0, 4)}, black, 1);
      sheet.text(tick_text(tick, x.step), at(tick, y.low) + cv::Point2d(0, 17), Sheet::Align::kMiddle, false);
    }
    sheet.line({at(x.low, y.high), at(x.low, y.low), at(x.high, y.low)}, black, 1);
    sheet.text(panel.title, {left + width / 2, top - 12}, Sheet::Align::kMiddle, false);
    sheet.text(panel.x_label, {left + width / 2, top + height + 36}, Sheet::Align::kMiddle, false);
    sheet.text(panel.y_label, {left - 44, top + height / 2}, Sheet::Align::kMiddle, true);
    for (std::size_t c = 0; c < panel.curves.size(); ++c) {
      const std::array<int, 3>& colour = kColours[c % kColours.size()];
      const auto& points = panel.curves[c].points;
      std::vector<cv::Point2d> line;
      for (const ChartPoint& p : points) {
        line.push_back(at(p.x, p.y));
        if (p.interval) sheet.line({at(p.x, (*p.interval)[0]), at(p.x, (*p.interval)[1])}, colour, 0.7);
      }
      if (line.size() > 1) sheet.line(line, colour, 1.4);
      for (std::size_t i = 0; i < points.size(); ++i) sheet.dot(line[i], colour, points[i]);
      const cv::Point2d legend(left + width + 10, top + 10 + 17 * static_cast<double>(c));
      sheet.line({legend, legend + cv::Point2d(16, 0)}, colour, 2);
      sheet.text(panel.curves[c].name, legend + cv::Point2d(21, 4), Sheet::Align::kLeft, false);
    }
  }
}

cv::Size size_of(const Chart& chart) {
  const int panels = static_cast<int>(chart.panels.size()), columns = std::min(panels, chart.columns);
  return {columns * kWidth, (panels + chart.columns - 1) / chart.columns * kHeight};
}

}  // namespace

std::string chart_svg(const Chart& chart, const std::set<std::size_t>& linked) {
  SvgSheet sheet(size_of(chart).width, size_of(chart).height, linked);
  draw(sheet, chart);
  return sheet.finished();
}

cv::Mat chart_picture(const Chart& chart) {
  PictureSheet sheet(size_of(chart).width, size_of(chart).height);
  draw(sheet, chart);
  return sheet.finished();
}

ordered_json chart_json(const Chart& chart, const std::set<std::size_t>& linked) {
  const auto [x, y] = axes_of(chart);
  ordered_json out{{"x", {x.low, x.high}}, {"y", {y.low, y.high}}, {"panels", ordered_json::array()}};
  for (const ChartPanel& panel : chart.panels) {
    ordered_json curves = ordered_json::array();
    for (std::size_t c = 0; c < panel.curves.size(); ++c) {
      const auto& [red, green, blue] = kColours[c % kColours.size()];
      ordered_json dots = ordered_json::array();
      for (const ChartPoint& p : panel.curves[c].points)
        dots.push_back({{"x", p.x},
                        {"y", p.y},
                        {"interval", p.interval ? ordered_json(*p.interval) : ordered_json()},
                        {"link", linked.contains(p.point) ? ordered_json(link_to(p.point)) : ordered_json()}});
      curves.push_back(
          {{"name", panel.curves[c].name}, {"colour", fmt::format("rgb({},{},{})", red, green, blue)}, {"dots", dots}});
    }
    out["panels"].push_back(
        {{"title", panel.title}, {"x_label", panel.x_label}, {"y_label", panel.y_label}, {"curves", curves}});
  }
  return out;
}

}  // namespace tankrig
