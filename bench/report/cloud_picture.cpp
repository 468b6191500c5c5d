#include "bench/report/cloud_picture.hpp"

#include <fmt/core.h>

#include <array>
#include <map>

#include "bench/metrics/verdict_cloud.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

const Colour kBody{232, 230, 228}, kEdge{120, 118, 116};
constexpr double kDotRadius = 1.3;  ///< [px]
constexpr double kCrease = 0.9;     ///< cosine between two faces below which their edge is drawn

Colour colour_of(PointVerdict verdict) {
  const auto [red, green, blue] = verdict_colour(verdict);
  return {blue, green, red};
}

using Edge = std::pair<int, int>;

/// Edges where the surface bends sharply or ends.
std::vector<Edge> sharp_edges(const TriangleMesh& mesh) {
  std::map<Edge, std::vector<Vector3d>> normals;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vector3d normal = (b - a).cross(c - a).normalized();
    for (int i = 0; i < 3; ++i) normals[std::minmax({t[i], t[(i + 1) % 3]})].push_back(normal);
  }
  std::vector<Edge> edges;
  for (const auto& [edge, n] : normals)
    if (n.size() != 2 || n[0].dot(n[1]) < kCrease) edges.push_back(edge);
  return edges;
}

std::vector<Vector3d> corners_around(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = mesh.bounds();
  const double margin = 0.25 * box.sizes().maxCoeff();
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    Vector3d corner = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    corner.head<2>() += (corner - box.center()).head<2>().cwiseSign() * margin;
    corners.push_back(corner);
  }
  return corners;
}

std::string counted(const char* what, std::size_t count) { return fmt::format("{}: {}", what, count); }

}  // namespace

Viewpoint back_view() { return {{-1.0, 0.9, 0.45}, {0, 0, 1}}; }

Viewpoint view_from(const Vector3d& camera_o, const TriangleMesh& mesh) {
  return {camera_o - mesh.bounds().center(), {0, 0, 1}};
}

cv::Mat draw_cloud_over_object(const PointCloud& cloud, const std::vector<PointVerdict>& verdicts,
                               const TriangleMesh& mesh, const CloudPictureOptions& options) {
  if (verdicts.size() != cloud.points.size())
    throw InputError(
        fmt::format("cloud picture: found {} verdicts, expected {}", verdicts.size(), cloud.points.size()));
  Canvas canvas(options.width, options.height, options.view, corners_around(mesh));
  for (const Eigen::Vector3i& t : mesh.triangles)
    canvas.triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], kBody);
  const double lift = 0.004 * mesh.bounds().sizes().norm();
  for (const auto& [a, b] : sharp_edges(mesh)) canvas.line(mesh.vertices[a], mesh.vertices[b], kEdge, 1.2, lift / 4);

  std::array<std::size_t, 4> counts{};
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    ++counts[static_cast<std::size_t>(verdicts[i])];
    // A measured surface lies a little inside the true one as often as outside: it is lifted to be seen.
    if (cloud.points[i].p.allFinite()) canvas.dot(cloud.points[i].p, colour_of(verdicts[i]), kDotRadius, 2 * lift);
  }
  cv::Mat picture = canvas.picture();
  std::vector<LegendEntry> legend;
  const auto entry = [&](PointVerdict verdict, const char* what) {
    legend.push_back({colour_of(verdict), counted(what, counts[static_cast<std::size_t>(verdict)])});
  };
  entry(PointVerdict::kObject, "object");
  entry(PointVerdict::kOutlier, "outlier");
  entry(PointVerdict::kGround, "ground");
  if (counts[static_cast<std::size_t>(PointVerdict::kRejected)]) entry(PointVerdict::kRejected, "between thresholds");
  legend.push_back({kBody, "the object's mesh"});
  put_legend(picture, legend, {14, options.title.empty() ? 14 : 42});
  if (!options.title.empty()) put_boxed_text(picture, options.title, {20, 26}, kInk, 12);
  put_scale_bar(picture, canvas.pixels_per_metre(), {18, options.height - 22});
  return picture;
}

}  // namespace tankrig
