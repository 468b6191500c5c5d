// A report's clouds in 3D: what the page holds of them, and that a browser draws them.
#include "bench/report/cloud_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "bench/report/report_html.hpp"
#include "core/camera_model.hpp"
#include "tests/support/temporary_folder.hpp"

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

TEST(CloudView, HoldsEveryPointToATenthOfAMillimetre) {
  const ViewedCloud viewed = grid_of_points(4);
  const auto scene = nlohmann::json::parse(cloud_view_json(cube(), {viewed}, {}));
  const auto& cloud = scene["clouds"][0];
  EXPECT_EQ(cloud["shown"], 32);
  EXPECT_EQ(cloud["all"], 32);
  EXPECT_EQ(scene["triangles"].size(), 12u);
  EXPECT_EQ(cloud["points"].get<std::string>().size(), 256u);  // 192 bytes
  EXPECT_LT(cloud["step_m"].get<double>(), 1e-4);
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
  if (std::system("command -v chromium-headless-shell > /dev/null") != 0)
    GTEST_SKIP() << "no chromium-headless-shell (Debian package of that name)";
  ReportData report;
  report.title = "A cube";
  Transform oMc = Transform::Identity();  // looks down upon it from the side
  oMc.linear() = (Eigen::AngleAxisd(-2.4, Vector3d::UnitX())).toRotationMatrix();
  oMc.translation() = Vector3d(0, -0.7, 0.7);
  report.cloud_view = cloud_view_json(cube(), {grid_of_points(60)}, {camera_pyramid("mono", some_camera(), oMc)});
  const TemporaryFolder folder;
  folder.write("page.html", report_html(report));
  const std::string page = (folder.path() / "page.html").string(), shot = (folder.path() / "page.png").string();
  for (const int width : {1280, 480}) {
    const std::string command =
        "HOME=" + folder.path().string() +
        " timeout 200 chromium-headless-shell --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader "
        "--disable-dev-shm-usage --hide-scrollbars --virtual-time-budget=5000 --window-size=" +
        std::to_string(width) + ",1400 --screenshot=" + shot + " file://" + page + " > /dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0);
    const cv::Mat drawn = cv::imread(shot);
    ASSERT_EQ(drawn.size(), cv::Size(width, 1400));
    const auto pixels = [&](const cv::Scalar& bgr) {
      cv::Mat like;
      cv::inRange(drawn, bgr - cv::Scalar::all(12), bgr + cv::Scalar::all(12), like);
      return cv::countNonZero(like);
    };
    EXPECT_GT(pixels({0, 180, 0}), width) << "points of the object, window of " << width;
    EXPECT_GT(pixels({255, 20, 20}), width) << "outliers, window of " << width;
    EXPECT_GT(pixels({216, 216, 216}), 5 * width) << "the mesh, window of " << width;
    cv::Mat ink;
    cv::inRange(drawn.colRange(width - 10, width), cv::Scalar::all(0), cv::Scalar::all(250), ink);
    EXPECT_EQ(cv::countNonZero(ink), 0) << "something leads out of a window of " << width;
  }
}

}  // namespace
}  // namespace tankrig
