// The stripe where geometry says it must be, and dark where something stands in the sheet.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_backends/world/laser_sheet.hpp"
#include "sim_backends/world/laser_speckle.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim {
namespace {

using testing::empty_scene;
using testing::still;

/// A dim projector beside a distorting camera; the stripe runs along the image's rows.
Scene laser_scene() {
  Scene scene = empty_scene();
  CameraSpec& camera = scene.cameras[0];
  camera.model = {560, 340, 600, 640, 278.4, 172.7, -0.30, 0.12, -0.0011, 0.0017, 0};
  camera.wMc = testing::look_at({0.05, -0.30, 1.05}, {0.02, 0.05, 0});
  camera.psf_sigma_px = 0.7;
  scene.arm.q << 0, 0.12, 1.5, 0, 0;
  scene.laser.power_lm = 2.5;
  scene.laser.fan = 1.2;
  // The sheet, wherever the arm holds it: exit at (0, 0.5, 0.9), sheet through the line y = 0.06 x on the floor.
  const Transform wMe = scene.arm.wMb * scene.arm.model.bMe(scene.arm.q);
  Transform wMl = Transform::Identity();
  const Vector3d along = Vector3d(1, 0.06, 0).normalized(), exit(0, 0.5, 0.9);
  const Vector3d forward = (-exit - along * along.dot(-exit)).normalized();
  wMl.linear() << along.cross(forward), along, forward;
  wMl.translation() = exit;
  scene.laser.eMl = wMe.inverse() * wMl;
  return scene;
}

Plane sheet_plane(const Scene& scene, const JointVector& q) {
  const Transform wMl = scene.arm.wMb * scene.arm.model.bMe(q) * scene.laser.eMl;
  const Vector3d n = wMl.linear().col(0);
  return {n, -n.dot(wMl.translation())};
}

/// Row at which column `u` sees the sheet on the horizontal plane z = height.
double true_row(const Scene& scene, const Plane& sheet, double height, int u) {
  const CameraSpec& camera = scene.cameras[0];
  double low = 0, high = camera.model.height - 1;
  const auto side = [&](double v) {
    const ViewingRay ray = camera.wMc * camera.model.sight(u, v);
    return sheet.distance(ray.at((height - ray.origin.z()) / ray.direction.z()));
  };
  const double at_low = side(low);
  for (int i = 0; i < 50; ++i) {
    const double mid = 0.5 * (low + high);
    (side(mid) * at_low > 0 ? low : high) = mid;
  }
  return 0.5 * (low + high);
}

/// Centre of mass of column `u` within 8 rows of `near`, or -1 if the column is dark there.
double centroid(const cv::Mat& image, int u, double near) {
  double sum = 0, moment = 0;
  for (int v = std::max(0, static_cast<int>(near) - 8); v <= std::min(image.rows - 1, static_cast<int>(near) + 9);
       ++v) {
    sum += image.at<std::uint8_t>(v, u);
    moment += v * static_cast<double>(image.at<std::uint8_t>(v, u));
  }
  return sum > 100 ? moment / sum : -1;
}

void expect_stripe(const Scene& scene, const cv::Mat& image, const Plane& sheet, double height, int from, int to) {
  double square = 0, mean = 0, worst = 0;
  int columns = 0;
  for (int u = from; u <= to; ++u) {
    const double truth = true_row(scene, sheet, height, u), seen = centroid(image, u, truth);
    worst = std::max(worst, std::abs(seen - truth));
    square += std::pow(seen - truth, 2), mean += seen - truth, ++columns;
  }
  EXPECT_LT(worst, 0.05);
  EXPECT_LT(std::sqrt(square / columns), 0.02);
  EXPECT_NEAR(mean / columns, 0, 0.01);
}

TEST(RenderLaser, DrawsTheStripeWhereTheSheetMeetsTheFloor) {
  const Scene scene = laser_scene();
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("mono", still(scene, 1));
  double brightest;
  cv::minMaxLoc(image, nullptr, &brightest);
  ASSERT_GT(brightest, 60);
  ASSERT_LT(brightest, 255) << "clipped";
  expect_stripe(scene, image, sheet_plane(scene, scene.arm.q), 0, 60, 500);
}

TEST(RenderLaser, DrawsTheStripeBehindAFlatPortWhereTheModelSeesIt) {
  Scene scene = laser_scene();
  scene.cameras[0].model.port = FlatPort{0.04, 0.008, Vector3d(0.02, 0.03, 1).normalized()};
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("mono", still(scene, 1));
  expect_stripe(scene, image, sheet_plane(scene, scene.arm.q), 0, 120, 440);
}

TEST(RenderLaser, AveragesTheExposuresPostures) {
  Scene scene = laser_scene();
  Exposure exposure = still(scene, 1);
  exposure.q[0][kElbow] -= 0.0004, exposure.q[2][kElbow] += 0.0004;
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("mono", exposure);
  expect_stripe(scene, image, sheet_plane(scene, exposure.q[1]), 0, 110, 460);
  exposure.laser = {1, 0, 0};
  scene.laser.power_lm *= 3;
  const cv::Mat early = TankWorld::from_scene(scene, {}).render("mono", exposure);
  expect_stripe(scene, early, sheet_plane(scene, exposure.q[0]), 0, 110, 460);
}

Scene laser_on_box() {
  Scene scene = laser_scene();
  SceneObject box;
  box.mesh = testing::write_box({0.24, 0.30, 0.16}, "laser_box");
  box.wMo.translation() = Vector3d(0, 0.0, 0.16);
  box.material.albedo = Rgb::Constant(0.5f);
  scene.objects = {box};
  return scene;
}

TEST(RenderLaser, StepsUpOnABoxByItsHeight) {
  const Scene scene = laser_on_box();
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("mono", still(scene, 1));
  const Plane sheet = sheet_plane(scene, scene.arm.q);
  expect_stripe(scene, image, sheet, 0.16, 200, 320);
  expect_stripe(scene, image, sheet, 0, 60, 110);
}

TEST(RenderLaser, LeavesTheFloorDarkInTheShadowOfABox) {
  const Scene scene = laser_on_box();
  const RenderGeometry geometry(scene);
  const SheetPose pose(scene.arm.wMb * scene.arm.model.bMe(scene.arm.q) * scene.laser.eMl);
  // The top's edge at x = 0.12, z = 0.16 as seen from the exit at (0, 0.5, 0.9): shadow to x = 0.12 * 0.9 / 0.74.
  const float edge = 0.12f * 0.9f / 0.74f;
  for (const float x : {0.0f, 0.5f * edge, 0.98f * edge})
    EXPECT_FALSE(laser_reaches(pose, {x, 0.06f * x, 0}, Vector3f::UnitZ(), geometry, {})) << x;
  EXPECT_TRUE(laser_reaches(pose, {1.03f * edge, 0.0618f * edge, 0}, Vector3f::UnitZ(), geometry, {}));
}

TEST(RenderLaser, IsBlockedByAnArmInTheSheetButNotByItsOwnHousing) {
  const Scene scene = laser_scene();
  const RenderGeometry geometry(scene);
  const SheetPose pose(scene.arm.wMb * scene.arm.model.bMe(scene.arm.q) * scene.laser.eMl);
  const Vector3f middle = pose.exit + 0.4f * pose.forward;
  Capsule bar{middle - 0.2f * pose.normal, middle + 0.2f * pose.normal, 0.02f, Rgb::Constant(0.5f), false};
  const Vector3f p(0, 0, 0);
  EXPECT_FALSE(laser_reaches(pose, p, Vector3f::UnitZ(), geometry, bodies_in_sheet({bar}, pose)));
  bar.projector = true;
  EXPECT_TRUE(laser_reaches(pose, p, Vector3f::UnitZ(), geometry, bodies_in_sheet({bar}, pose)));
}

TEST(RenderLaser, SpendsTheProjectorsWholeFluxOnTheSheet) {
  LaserLine line;
  line.power_lm = 6;
  const LaserSheet sut(line, 0);
  for (const float range : {0.4f, 1.1f}) {
    double fan = 0, section = 0;
    constexpr int kSteps = 4000;
    for (int i = 0; i < kSteps; ++i) {
      const double angle = line.fan * ((i + 0.5) / kSteps - 0.5);
      fan += sut.line_density(range, static_cast<float>(std::tan(angle))) * range * line.fan / kSteps;
      const double x = 0.01 * ((i + 0.5) / kSteps - 0.5);
      section += sut.illuminance(range, 0, static_cast<float>(x), 1e-7f) * 0.01 / kSteps;
    }
    EXPECT_NEAR(fan, 6, 0.006);
    EXPECT_NEAR(section, sut.line_density(range, 0), 1e-3 * section);
  }
}

TEST(RenderLaser, HasItsStated1e2HalfWidthAndAttenuation) {
  LaserLine line;
  const LaserSheet sut(line, 0.05f), clear(line, 0);
  const double half = line.half_width + line.divergence * 0.8;
  EXPECT_NEAR(sut.illuminance(0.8f, 0, static_cast<float>(half), 0) / sut.illuminance(0.8f, 0, 0, 0), std::exp(-2),
              1e-4);
  EXPECT_NEAR(sut.illuminance(0.8f, 0, 0, 0) / clear.illuminance(0.8f, 0, 0, 0), std::exp(-0.04), 1e-5);
}

TEST(RenderLaser, GlowsInTheWaterOnlyWhereItScatters) {
  Scene scene = laser_scene();
  scene.tank.floor.albedo = Rgb::Zero();
  const cv::Mat clear = TankWorld::from_scene(scene, {}).render("mono", still(scene, 1));
  EXPECT_EQ(cv::countNonZero(clear), 0);
  scene.water.laser_scattering = 1.0f;
  const cv::Mat hazy = TankWorld::from_scene(scene, {}).render("mono", still(scene, 1));
  EXPECT_GT(cv::countNonZero(hazy), 1000);
  const Plane sheet = sheet_plane(scene, scene.arm.q);
  EXPECT_EQ(hazy.at<std::uint8_t>(static_cast<int>(true_row(scene, sheet, 0, 280)) + 60, 280), 0)
      << "glow on the side of the stripe where no ray crosses the sheet";
}

TEST(RenderLaser, SpecklesWithTheStatedContrast) {
  double sum = 0, square = 0, product = 0;
  constexpr int kTiles = 400, kN = 16;
  for (int t = 0; t < kTiles; ++t) {
    const SpeckleTile<kN> tile(99, kN * t, 0, 0.3f);
    for (int y = 0; y < kN; ++y)
      for (int x = 0; x < kN; ++x) {
        sum += tile.at(x, y), square += tile.at(x, y) * tile.at(x, y);
        if (x + 4 < kN) product += (tile.at(x, y) - 1) * (tile.at(x + 4, y) - 1);
      }
  }
  const double n = kTiles * kN * kN, mean = sum / n, sd = std::sqrt(square / n - mean * mean);
  EXPECT_NEAR(mean, 1, 0.01);
  EXPECT_NEAR(sd, 0.3, 0.01);
  EXPECT_NEAR(product / n / (sd * sd), 0, 0.02);
}

TEST(RenderLaser, SpecklesAlikeOnBothSidesOfATilesEdge) {
  const SpeckleTile<16> tile(5, 32, 48, 0.3f), shifted(5, 33, 47, 0.3f);
  EXPECT_EQ(tile.at(7, 3), shifted.at(6, 4));
}

}  // namespace
}  // namespace tankrig::sim
