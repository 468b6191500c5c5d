// Floating particles: how many, where, and where the cameras see them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim_backends/world/particles.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim {
namespace {

Scene hazy_scene(double per_m3) {
  Scene scene = testing::empty_scene();
  scene.water.particles_per_m3 = per_m3;
  return scene;
}

TEST(RenderParticles, AreAsManyAsTheirDensitySays) {
  const double volume = 2.0 * 2.0 * 1.4;
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    EXPECT_NEAR(static_cast<double>(ParticleField(hazy_scene(1000), seed).count()), 1000 * volume,
                4 * std::sqrt(1000 * volume));
  }
  EXPECT_EQ(ParticleField(hazy_scene(0), 1).count(), 0u);
  double few = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed)
    few += static_cast<double>(ParticleField(hazy_scene(1), seed).count());
  EXPECT_NEAR(few / 500, volume, 4 * std::sqrt(volume / 500));
}

TEST(RenderParticles, FillTheTankEvenlyAtEveryTime) {
  const ParticleField sut(hazy_scene(2000), 5);
  for (const std::int64_t ns : {0LL, 100'000'000'000LL}) {
    std::array<int, 8> octant{};
    for (std::size_t i = 0; i < sut.count(); ++i) {
      const Vector3f p = sut.position(i, Stamp{ns});
      ASSERT_TRUE(std::abs(p.x()) <= 1.0001f && std::abs(p.y()) <= 1.0001f && p.z() >= 0 && p.z() <= 1.4001f);
      ++octant[(p.x() > 0) + 2 * (p.y() > 0) + 4 * (p.z() > 0.7f)];
    }
    const double expected = static_cast<double>(sut.count()) / 8;
    for (const int n : octant) EXPECT_NEAR(n, expected, 5 * std::sqrt(expected));
  }
}

TEST(RenderParticles, DriftWithTheWater) {
  const Scene scene = hazy_scene(500);
  const ParticleField sut(scene, 5);
  Vector3d mean = Vector3d::Zero();
  for (std::size_t i = 0; i < sut.count(); ++i)
    mean += sut.particle(i).velocity.cast<double>() / static_cast<double>(sut.count());
  EXPECT_LT((mean - scene.water.particle_drift).norm(), 0.15 * scene.water.particle_drift.norm());
}

TEST(RenderParticles, AppearWhereTheCameraModelProjectsThem) {
  Scene scene = hazy_scene(60);
  scene.tank.floor.albedo = Rgb::Zero();
  scene.lamps = {{"lamp", {0, 0, 1.3}, {0, 0, -1}, 20000, 1.4, {1, 1, 1}}};
  scene.cameras[0].psf_sigma_px = 0.7;
  const CameraSpec& camera = scene.cameras[0];
  WorldOptions options;
  options.seed = 11;
  Exposure exposure = testing::still(scene, 0);
  exposure.mid = Stamp{7'000'000'000};
  const cv::Mat image = TankWorld::from_scene(scene, options).render("mono", exposure);
  const ParticleField field(scene, options.seed);
  int sharp = 0, seen = 0;
  for (std::size_t i = 0; i < field.count(); ++i) {
    const Vector3d c = camera.wMc.inverse() * field.position(i, exposure.mid).cast<double>();
    if (c.z() < 0.5) continue;
    const auto pixel = camera.model.project(c);
    if (pixel->x() < 3 || pixel->y() < 3 || pixel->x() > camera.model.width - 4 || pixel->y() > camera.model.height - 4)
      continue;
    ++sharp;
    cv::Mat around =
        image(cv::Rect(static_cast<int>(pixel->x() + 0.5) - 1, static_cast<int>(pixel->y() + 0.5) - 1, 3, 3));
    double brightest;
    cv::minMaxLoc(around, nullptr, &brightest);
    seen += brightest > 0;
  }
  ASSERT_GT(sharp, 10);
  EXPECT_GE(seen, 0.9 * sharp);
  EXPECT_LT(cv::countNonZero(image), 0.1 * static_cast<double>(image.total())) << "and nowhere else";
}

}  // namespace
}  // namespace tankrig::sim
