// A report's clouds in 3D: what the page holds of them, and that a browser draws them.
#include "bench/report/cloud_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <nlohmann/json.hpp>

#include "bench/report/report_html.hpp"
#include "bench/report/web_programs.hpp"
#include "core/camera_model.hpp"
#include "tests/support/browser.hpp"

namespace tankrig {
namespace {

/// The top face of a cube of 0.2 m, and its sides.
TriangleMesh cube() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(i & 1 ? 0.1 : -0.1, i & 2 ? 0.1 : -0.1, i & 4 ? 0 : -0.2);
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    mesh.triangles.emplace_back(q[0], q[1], q[2]);
    mesh.triangles.emplace_back(q[0], q[2], q[3]);
  }
  return mesh;
}

/// `side` x `side` points on the top face, and as many of each other kind on the floor around it.
ViewedCloud grid_of_points(int side) {
  ViewedCloud viewed{"laser", {}, {}};
  const auto add = [&](double x, double y, double z, PointVerdict verdict) {
    CloudPoint point;
    point.p = {x, y, z};
    viewed.cloud.points.push_back(point);
    viewed.verdicts.push_back(verdict);
  };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const double x = 0.2 * (i + 0.5) / side - 0.1, y = 0.2 * (j + 0.5) / side - 0.1;
      add(x, y, 0, PointVerdict::kObject);
      add(x - 0.3, y, -0.2, PointVerdict::kOutlier);
    }
  return viewed;
}

CameraModel some_camera() {
  CameraModel model;
  model.width = 640, model.height = 480;
  model.fx = model.fy = 500, model.cx = 320, model.cy = 240;
  return model;
}

/// The bytes that base64 `text` stands for.
std::vector<std::uint8_t> bytes_of(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  unsigned held = 0, bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    held = held << 6 | static_cast<unsigned>(letters.find(c));
    if ((bits += 6) >= 8) bytes.push_back(static_cast<std::uint8_t>(held >> (bits -= 8)));
  }
  return bytes;
}

/// What a page's cloud holds, point by point.
ViewedCloud decoded(const nlohmann::json& cloud) {
  ViewedCloud viewed{cloud["name"], {}, {}};
  const auto places = bytes_of(cloud["points"]), verdicts = bytes_of(cloud["verdicts"]);
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    CloudPoint point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = 6 * i + 2 * axis;
      point.p[static_cast<int>(axis)] =
          cloud["step_m"].get<double>() * static_cast<std::int16_t>(places.at(at) | places.at(at + 1) << 8);
    }
    viewed.cloud.points.push_back(point);
    viewed.verdicts.push_back(static_cast<PointVerdict>(verdicts[i]));
  }
  return viewed;
}

TEST(CloudView, HoldsEveryPointToATenthOfAMillimetre) {
  const ViewedCloud given = grid_of_points(20);
  const auto scene = nlohmann::json::parse(cloud_view_json(cube(), {given}, {}));
  const auto& cloud = scene["clouds"][0];
  EXPECT_EQ(cloud["shown"], 800);
  EXPECT_EQ(cloud["all"], 800);
  EXPECT_EQ(scene["triangles"].size(), 12u);
  const ViewedCloud held = decoded(cloud);
  EXPECT_EQ(held.name, given.name);
  EXPECT_EQ(held.verdicts, given.verdicts);
  ASSERT_EQ(held.cloud.points.size(), given.cloud.points.size());
  for (std::size_t i = 0; i < given.cloud.points.size(); ++i)
    EXPECT_LT((held.cloud.points[i].p - given.cloud.points[i].p).norm(), 1e-4) << i;
}

TEST(CloudView, ThinsALargeCloudAndSaysSo) {
  const auto scene = nlohmann::json::parse(cloud_view_json(cube(), {grid_of_points(200)}, {}));
  EXPECT_EQ(scene["clouds"][0]["all"], 80'000);
  EXPECT_EQ(scene["clouds"][0]["shown"], 40'000);
}

TEST(CloudView, CannotEndTheScriptItStandsIn) {
  ViewedCloud viewed = grid_of_points(1);
  viewed.name = "</script><script>alert(1)</script>\xff";
  const std::string text = cloud_view_json(cube(), {viewed}, {});
  EXPECT_EQ(text.find('<'), std::string::npos);
  EXPECT_THAT(nlohmann::json::parse(text)["clouds"][0]["name"].get<std::string>(), testing::StartsWith("</script>"));
}

TEST(CloudView, IsDrawnByABrowserInWideWindowsAndNarrowOnes) {
  if (cloud_view_program().empty()) GTEST_SKIP() << "built without the 3D view: TANKRIG_CLOUD_VIEW, which needs npm";
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  ReportData report;
  report.title = "A cube";
  Transform oMc = Transform::Identity();  // looks down upon it from the side
  oMc.linear() = (Eigen::AngleAxisd(-2.4, Vector3d::UnitX())).toRotationMatrix();
  oMc.translation() = Vector3d(0, -0.7, 0.7);
  report.cloud_view = cloud_view_json(cube(), {grid_of_points(60)}, {camera_pyramid("mono", some_camera(), oMc)});
  const std::string page = report_html(report);
  EXPECT_THAT(page, testing::HasSubstr(report.cloud_view));
  const Browser browser(page);
  for (const int width : {1280, 480}) {
    const cv::Mat drawn = browser.drawn({width, 1400});
    ASSERT_EQ(drawn.size(), cv::Size(width, 1400));
    EXPECT_THAT(browser.leads_out_to(), testing::IsEmpty());
    EXPECT_GT(pixels_like(drawn, {0, 180, 0}), width) << "points of the object, window of " << width;
    EXPECT_GT(pixels_like(drawn, {255, 20, 20}), width) << "outliers, window of " << width;
    EXPECT_GT(pixels_like(drawn, {216, 216, 216}), 5 * width) << "the mesh, window of " << width;
    EXPECT_TRUE(ends_inside(drawn)) << "something leads out of a window of " << width;
  }
}

}  // namespace
}  // namespace tankrig
