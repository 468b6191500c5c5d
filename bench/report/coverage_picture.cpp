#include "bench/report/coverage_picture.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <unordered_map>

#include "bench/report/canvas.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

enum Direction { kPlusX, kMinusX, kPlusY, kMinusY, kPlusZ, kMinusZ };
constexpr std::array kSideNames{"+x", "-x", "+y", "-y", "+z (top)", "-z (bottom)"};

/// Panel coordinates of a point: right and down on the sheet, so that the six sides meet at their common edges.
struct Panel {
  Vector3d right, down;
  int column, row;  ///< in the cross: row 1 holds -x, top, +x, bottom; +y above and -y below the top
};

const std::array<Panel, 6>& panels() {
  static const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  static const std::array<Panel, 6> all{
      {{-z, -y, 2, 1}, {z, -y, 0, 1}, {x, z, 1, 0}, {x, -z, 1, 2}, {x, -y, 1, 1}, {-x, -y, 3, 1}}};
  return all;
}

Direction direction_of(const TriangleMesh& mesh, std::uint32_t triangle) {
  const Eigen::Vector3i& t = mesh.triangles[triangle];
  const Vector3d normal = (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<Direction>(2 * axis + (normal[axis] < 0 ? 1 : 0));
}

struct Layout {
  std::array<cv::Rect, 6> rects;
  std::array<Vector2d, 6> origin;  ///< panel coordinates [m] of each rect's top left corner
  double scale = 1;                ///< [px/m]
  cv::Size size;
};

constexpr int kGap = 6, kMargin = 18, kHeader = 34, kTextRoom = 150, kWidth = 900;

Layout lay_out(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = mesh.bounds();
  const Vector3d size = box.sizes().cwiseMax(1e-6);
  Layout out;
  out.scale = (kWidth - 2 * kMargin - 3 * kGap) / (2 * size.x() + 2 * size.z());
  const auto px = [&](double metres) { return std::max(1, int(std::lround(metres * out.scale))); };
  const std::array column_width{px(size.z()), px(size.x()), px(size.z()), px(size.x())};
  const std::array row_height{px(size.z()), px(size.y()), px(size.z())};
  for (std::size_t i = 0; i < 6; ++i) {
    const Panel& panel = panels()[i];
    int left = kMargin, top = kHeader;
    for (int c = 0; c < panel.column; ++c) left += column_width[static_cast<std::size_t>(c)] + kGap;
    for (int r = 0; r < panel.row; ++r) top += row_height[static_cast<std::size_t>(r)] + kGap;
    out.rects[i] = {left, top, column_width[static_cast<std::size_t>(panel.column)],
                    row_height[static_cast<std::size_t>(panel.row)]};
    const auto lowest = [&](const Vector3d& axis) { return std::min(axis.dot(box.min()), axis.dot(box.max())); };
    out.origin[i] = {lowest(panel.right), lowest(panel.down)};
  }
  const int low = kHeader + row_height[0] + row_height[1] + row_height[2] + 2 * kGap + kMargin;
  out.size = {kWidth, std::max(low, kHeader + kTextRoom)};
  return out;
}

struct Cell {
  std::array<long, 3> at;
  friend bool operator==(const Cell&, const Cell&) = default;
};

struct CellHash {
  std::size_t operator()(const Cell& c) const {
    return static_cast<std::size_t>(c.at[0] * 73856093L ^ c.at[1] * 19349663L ^ c.at[2] * 83492791L);
  }
};

Cell cell_of(const Vector3d& p, double size) {
  return {{std::lround(std::floor(p.x() / size)), std::lround(std::floor(p.y() / size)),
           std::lround(std::floor(p.z() / size))}};
}

std::string share_text(const char* what, double share) {
  return fmt::format("{}: {:.1f} % of the surface", what, 100 * share);
}

const std::array<Colour, 3> kColours{{{80, 160, 40}, {40, 140, 245}, {210, 208, 206}}};
enum Kind : std::uint8_t { kCovered, kMissed, kUnseeable };

}  // namespace

std::vector<std::uint8_t> covered_samples(const std::vector<SurfaceSample>& samples, const PointCloud& cloud,
                                          const std::vector<PointVerdict>& verdicts, double threshold) {
  if (verdicts.size() != cloud.points.size())
    throw InputError(
        fmt::format("covered samples: found {} verdicts, expected {}", verdicts.size(), cloud.points.size()));
  std::unordered_map<Cell, std::vector<Vector3d>, CellHash> grid;
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    if (verdicts[i] == PointVerdict::kObject) grid[cell_of(cloud.points[i].p, threshold)].push_back(cloud.points[i].p);
  const auto covered = [&](const Vector3d& p) {
    const Cell home = cell_of(p, threshold);
    for (long dx = -1; dx <= 1; ++dx)
      for (long dy = -1; dy <= 1; ++dy)
        for (long dz = -1; dz <= 1; ++dz) {
          const auto found = grid.find({{home.at[0] + dx, home.at[1] + dy, home.at[2] + dz}});
          if (found == grid.end()) continue;
          for (const Vector3d& q : found->second)
            if ((q - p).squaredNorm() <= threshold * threshold) return true;
        }
    return false;
  };
  std::vector<std::uint8_t> out(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) out[i] = covered(samples[i].p);
  return out;
}

cv::Mat draw_coverage_map(const TriangleMesh& mesh, const std::vector<SurfaceSample>& samples,
                          const std::vector<std::uint8_t>& covered, const std::vector<std::uint8_t>& reachable,
                          const std::string& title) {
  if (covered.size() != samples.size() || (!reachable.empty() && reachable.size() != samples.size()))
    throw InputError(fmt::format("coverage map: found {} covered and {} reachable entries, expected {}", covered.size(),
                                 reachable.size(), samples.size()));
  const Layout layout = lay_out(mesh);
  cv::Mat picture(layout.size, CV_8UC3, cv::Scalar::all(255));
  cv::Mat nearest(layout.size, CV_32F, cv::Scalar(1e30));
  // A sample colours the pixels that are nearer to it than to others, as far as its neighbours may be.
  const double spacing = std::sqrt(mesh.area() / std::max<std::size_t>(samples.size(), 1));
  const double reach = std::max(1.0, 2.5 * spacing * layout.scale);
  std::array<double, 3> shares{};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Kind kind = covered[i] ? kCovered : reachable.empty() || reachable[i] ? kMissed : kUnseeable;
    shares[kind] += samples[i].weight;
    const auto side = static_cast<std::size_t>(direction_of(mesh, samples[i].triangle));
    const Panel& panel = panels()[side];
    const cv::Rect& rect = layout.rects[side];
    const double u = (panel.right.dot(samples[i].p) - layout.origin[side].x()) * layout.scale + rect.x - 0.5;
    const double v = (panel.down.dot(samples[i].p) - layout.origin[side].y()) * layout.scale + rect.y - 0.5;
    for (int y = std::max(rect.y, int(std::ceil(v - reach))); y <= std::min<double>(rect.br().y - 1, v + reach); ++y)
      for (int x = std::max(rect.x, int(std::ceil(u - reach))); x <= std::min<double>(rect.br().x - 1, u + reach);
           ++x) {
        const auto squared = float((x - u) * (x - u) + (y - v) * (y - v));
        if (squared > reach * reach || squared >= nearest.at<float>(y, x)) continue;
        nearest.at<float>(y, x) = squared;
        picture.at<Colour>(y, x) = kColours[kind];
      }
  }
  for (std::size_t side = 0; side < 6; ++side) {
    const cv::Rect& rect = layout.rects[side];
    cv::rectangle(picture, rect, cv::Scalar::all(110), 1);
    put_text(picture, kSideNames[side], {rect.x + 5, rect.y + 15}, kInk, 9);
  }
  if (!title.empty()) put_text(picture, title, {kMargin, 22}, kInk, 12);
  std::vector<LegendEntry> legend{{kColours[kCovered], share_text("covered", shares[kCovered])}};
  legend.push_back(
      {kColours[kMissed], share_text(reachable.empty() ? "not covered" : "seen, not covered", shares[kMissed])});
  if (!reachable.empty()) legend.push_back({kColours[kUnseeable], share_text("not seeable", shares[kUnseeable])});
  put_legend(picture, legend, {layout.rects[kPlusX].x, kHeader});
  put_scale_bar(picture, layout.scale, {layout.rects[kPlusX].x + 4, layout.size.height - 22});
  return picture;
}

}  // namespace tankrig
