// Lamps, sky and water against closed formulas.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim_backends/world/radiometry.hpp"
#include "sim_backends/world/surface_texture.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim {
namespace {

using testing::empty_scene;
using testing::still;

Lamp lamp_above(double height, double candela) { return {"lamp", {0, 0, height}, {0, 0, -1}, candela, 1.0, {1, 1, 1}}; }

/// Configuration factor of a parallel rectangle of sides a, b at distance c, seen from below its centre.
double sky_share(double a, double b, double c) {
  const double x = a / 2 / c, y = b / 2 / c;
  const double quarter =
      x / std::hypot(1, x) * std::atan(y / std::hypot(1, x)) + y / std::hypot(1, y) * std::atan(x / std::hypot(1, y));
  return 4 * quarter / (2 * std::numbers::pi);
}

TEST(RenderLight, FollowsInverseSquareAndCosineLawUnderALamp) {
  Scene scene = empty_scene();
  scene.lamps = {lamp_above(1.2, 300)};
  const RenderGeometry geometry(scene);
  const Radiometry sut(scene, geometry);
  EXPECT_NEAR(sut.direct({0, 0, 0}, Vector3f::UnitZ())[1], 300 / (1.2 * 1.2), 0.02);
  const double r = std::hypot(0.5, 1.2), c = 1.2 / r, power = std::log(0.1) / std::log(std::cos(1.0));
  EXPECT_NEAR(sut.direct({0.3f, 0.4f, 0}, Vector3f::UnitZ())[1], 300 * std::pow(c, power) * c / (r * r), 0.02);
}

TEST(RenderLight, FallsToTenPercentOfTheIntensityAtTheLampsHalfAngle) {
  Scene scene = empty_scene();
  scene.lamps = {lamp_above(1.0, 100)};
  const RenderGeometry geometry(scene);
  const Radiometry sut(scene, geometry);
  const Vector3f p{0, static_cast<float>(0.3 * std::tan(1.0)), 0.7f};
  const Vector3f towards = (Vector3f(0, 0, 1) - p).normalized();
  EXPECT_NEAR(sut.direct(p, towards)[0] * (Vector3f(0, 0, 1) - p).squaredNorm(), 10, 0.01);
}

TEST(RenderLight, IsAttenuatedExponentiallyInEachChannel) {
  Scene scene = empty_scene();
  scene.lamps = {lamp_above(1.2, 300)};
  scene.water.attenuation = {0.34f, 0.05f, 0.6f};
  const RenderGeometry geometry(scene);
  const Radiometry sut(scene, geometry);
  const Rgb e = sut.direct({0, 0, 0}, Vector3f::UnitZ());
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(e[k], 300 / 1.44 * std::exp(-1.2 * scene.water.attenuation[k]), 0.02);
}

TEST(RenderLight, LeavesTheShadowOfABoxDark) {
  Scene scene = empty_scene();
  scene.lamps = {lamp_above(1.0, 300)};
  scene.lamps[0].position.x() = 0.5;
  SceneObject box;
  box.mesh = testing::write_box({0.2, 0.2, 0.2}, "shadow_box");
  box.wMo.translation() = Vector3d(0, 0, 0.2);
  scene.objects = {box};
  const RenderGeometry geometry(scene);
  const Radiometry sut(scene, geometry);
  // The top's far edge at x = -0.1, z = 0.2 throws its shadow's end to x = -0.25.
  EXPECT_EQ(sut.direct({-0.249f, 0, 0}, Vector3f::UnitZ())[1], 0);
  EXPECT_GT(sut.direct({-0.251f, 0, 0}, Vector3f::UnitZ())[1], 1);
}

TEST(RenderLight, GivesTheSkysConfigurationFactorOnABlackTanksFloor) {
  Scene scene = empty_scene();
  scene.ambient_lux = 80;
  scene.tank.floor.albedo = Rgb::Zero();
  const RenderGeometry geometry(scene);
  const Radiometry sut(scene, geometry);
  const double expected = 80 * sky_share(2.0, 2.0, 1.4);
  EXPECT_NEAR(sut.ambient({0, 0, 0}, Vector3f::UnitZ(), 32)[1], expected, 0.01 * expected);
}

TEST(RenderLight, ReachesEverySurfaceByReflectionAtLightOne) {
  Scene scene = testing::full_scene();
  const RenderGeometry geometry(scene);
  const Radiometry sut(scene, geometry);
  for (const Vector3f& n : {Vector3f(1, 0, 0), Vector3f(-1, 0, 0), Vector3f(0, 1, 0), Vector3f(0, -1, 0)})
    EXPECT_GT(sut.ambient(Vector3f(0.05f, 0, 0.08f) + 0.2f * n, n).minCoeff(), 2) << n.transpose();
}

TEST(RenderLight, IsLinearInTheImageAndAtTheLuxMeter) {
  Scene scene = testing::small_scene();
  scene.water.particles_per_m3 = 0;
  const auto at = [&](double light) {
    WorldOptions options;
    options.light = light;
    return TankWorld::from_scene(scene, options);
  };
  const TankWorld full = at(1), half = at(0.5), dark = at(0);
  EXPECT_NEAR(half.lux(), 0.5 * full.lux(), 1e-6 * full.lux());
  EXPECT_EQ(dark.lux(), 0);
  const cv::Mat bright = full.render("left", still(scene, 0)), dim = half.render("left", still(scene, 0));
  for (int v = 5; v < bright.rows; v += 25)
    for (int u = 5; u < bright.cols; u += 25)
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(dim.at<cv::Vec3b>(v, u)[c], 0.5 * bright.at<cv::Vec3b>(v, u)[c], 0.76) << u << ',' << v;
  EXPECT_EQ(cv::norm(dark.render("left", still(scene, 0)), cv::NORM_INF), 0);
}

TEST(RenderLight, BecomesNumbersByAlbedoRangeVeilAndSensorScale) {
  Scene scene = empty_scene();
  scene.lamps = {lamp_above(1.2, 300)};
  scene.lamps[0].half_angle = 1.5;
  scene.tank.floor.albedo = Rgb::Constant(0.5f);
  scene.water.attenuation = Rgb::Constant(0.2f);
  scene.water.backscatter = Rgb::Constant(0.7f);
  scene.water.veil = Rgb::Constant(40.0f);
  const RenderGeometry geometry(scene);
  const Radiometry light(scene, geometry);
  const CameraSpec& camera = scene.cameras[0];
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("mono", still(scene, 0));
  for (const auto& [u, v] : {std::pair{161, 118}, {40, 60}, {300, 200}}) {
    const Vector3d ray = camera.wMc.linear() * camera.model.ray(u, v);
    const double range = -camera.wMc.translation().z() / ray.z();
    const Vector3f p = (camera.wMc.translation() + range * ray).cast<float>();
    const double e = light.direct(p, Vector3f::UnitZ())[1] + light.ambient(p, Vector3f::UnitZ())[1];
    const double expected = 0.5 * e * std::exp(-0.2 * range) + 40 * (1 - std::exp(-0.7 * range));
    EXPECT_NEAR(image.at<std::uint8_t>(v, u), expected, 0.8) << u << ',' << v;
  }
}

TEST(RenderTexture, FindsContrastInEveryWindowOfTheLabelledBox) {
  const Material material{{0.07f, 0.07f, 0.07f}, Material::Texture::kLabels, 0.7f, 0.008};
  for (const Eigen::Vector3f& n : {Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(0, -1, 0)})
    for (int window = 0; window < 40; ++window) {
      double sum = 0, square = 0;
      for (int k = 0; k < 15 * 15; ++k) {
        const float a = 0.001f * static_cast<float>(k % 15) + 0.0031f * static_cast<float>(window) - 0.06f;
        const float b = 0.001f * static_cast<float>(k / 15) - 0.0028f * static_cast<float>(window);
        const Eigen::Vector3f p = n.z() != 0   ? Eigen::Vector3f(a, b, 0)
                                  : n.x() != 0 ? Eigen::Vector3f(0.07f, a, b)
                                               : Eigen::Vector3f(a, -0.15f, b);
        const double x = texture_albedo(material, p, n)[1];
        sum += x, square += x * x;
      }
      const double mean = sum / 225, sd = std::sqrt(square / 225 - mean * mean);
      EXPECT_GT(sd / mean, 0.10) << "face " << n.transpose() << ", window " << window;
      EXPECT_NEAR(mean, 0.07, 0.04);
    }
}

}  // namespace
}  // namespace tankrig::sim
