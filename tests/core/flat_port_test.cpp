// Refraction by a flat port: against numbers worked out by hand, and its two directions against each other.
#include "core/flat_port.hpp"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "core/camera_model.hpp"

namespace tankrig {
namespace {

/// Behind 30 mm of air and 10 mm of glass; 4 / 3 is water.
CameraModel camera_behind_a_port() {
  CameraModel camera{640, 480, 500, 500, 319.5, 239.5};
  camera.port = FlatPort{0.03, 0.01, Vector3d::UnitZ(), 1, 1.5, 4 / 3.0};
  return camera;
}

TEST(FlatPort, BendsARayAsWorkedOutByHand) {
  // 30 degrees in air: sine 1/2; in glass 1/3, tangent 1/sqrt(8); in water 3/8, tangent 3/sqrt(55).
  const double in_air = 1 / std::sqrt(3), in_glass = 1 / std::sqrt(8), in_water = 3 / std::sqrt(55);
  const double at_face = 0.03 * in_air + 0.01 * in_glass;
  const CameraModel sut = camera_behind_a_port();
  const ViewingRay ray = sut.sight(319.5 + 500 * in_air, 239.5);
  EXPECT_LT((ray.origin - Vector3d(at_face, 0, 0.04)).norm(), 1e-15);
  EXPECT_LT((ray.direction - Vector3d(3, 0, std::sqrt(55)) / 8).norm(), 1e-15);

  const auto pixel = sut.project({0, at_face + in_water, 1.04});
  ASSERT_TRUE(pixel);
  EXPECT_LT((*pixel - Vector2d(319.5, 239.5 + 500 * in_air)).norm(), 1e-10);
}

TEST(FlatPort, SeesAPointOfEveryRayAtItsPixel) {
  constexpr unsigned kSeed = 4;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> share(0, 1);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    CameraModel sut{640, 480, 420, 430, 310, 250, -0.1, 0.02, 0.001, -0.002, 0.001};
    sut.port = FlatPort{0.1 * share(random), 0.03 * share(random), Vector3d::UnitZ(), 1, 1.4 + 0.3 * share(random)};
    sut.port->normal = Vector3d(0.4 * share(random) - 0.2, 0.4 * share(random) - 0.2, 1).normalized();
    const Vector2d pixel(640 * share(random), 480 * share(random));
    const ViewingRay ray = sut.sight(pixel.x(), pixel.y());
    EXPECT_NEAR(ray.direction.norm(), 1, 1e-14);
    const auto back = sut.project(ray.at(1e-3 + 3 * share(random)));
    ASSERT_TRUE(back);
    worst = std::max(worst, (*back - pixel).norm());
  }
  std::cout << "worst " << worst << " px\n";
  EXPECT_LT(worst, 1e-9);
}

TEST(FlatPort, SeesFarAsideThroughThinAir) {
  // 80 degrees from the normal, 1 mm before the face: the light comes along it, as from beyond the critical angle.
  CameraModel sut = camera_behind_a_port();
  sut.port->distance = 0.001;
  const Vector3d p(1, 0, 0.15);
  const auto pixel = sut.project(p);
  ASSERT_TRUE(pixel);
  const ViewingRay ray = sut.sight(pixel->x(), pixel->y());
  EXPECT_LT((p - ray.origin).cross(ray.direction).norm(), 1e-12);
}

TEST(FlatPort, ItsLinesOfSightMeetItsAxis) {
  CameraModel sut = camera_behind_a_port();
  sut.port->normal = Vector3d(0.1, -0.05, 1).normalized();
  for (const Vector2d& pixel : {Vector2d(0, 0), Vector2d(500, 40), Vector2d(630, 470)}) {
    const ViewingRay ray = sut.sight(pixel.x(), pixel.y());
    EXPECT_NEAR(ray.origin.cross(ray.direction).dot(sut.port->normal), 0, 1e-16);
    EXPECT_NEAR(sut.port->normal.dot(ray.origin), 0.04, 1e-15);
  }
}

TEST(FlatPort, OfAirChangesNothing) {
  CameraModel sut = camera_behind_a_port(), pinhole = sut;
  pinhole.port.reset();
  sut.port->air = sut.port->glass = sut.port->water = 1;
  const Vector3d p(0.3, -0.2, 0.8);
  EXPECT_LT((*sut.project(p) - *pinhole.project(p)).norm(), 1e-10);
}

TEST(FlatPort, SeesNothingInsideOfTheHousing) {
  const CameraModel sut = camera_behind_a_port();
  EXPECT_FALSE(sut.project({0, 0, 0.035}));
  EXPECT_TRUE(sut.project({0, 0, 0.0401}));
  EXPECT_FALSE(sut.project({0, 0, -1}));
}

TEST(FlatPort, APinholeWouldSeeThePointThatThePixelShows) {
  CameraModel sut = camera_behind_a_port();
  const Vector3d p(0.31, 0.12, 0.9);
  const Vector2d pixel = *sut.project(p);
  EXPECT_LT((sut.normalized(pixel.x(), pixel.y(), 0.9) - Vector2d(0.31, 0.12) / 0.9).norm(), 1e-13);
  sut.port.reset();
  EXPECT_EQ(sut.normalized(100, 200, 0.9), sut.normalized(100, 200));
}

TEST(FlatPort, KnowsANormalThatPixelsDoNotLookAlong) {
  CameraModel sut = camera_behind_a_port();
  EXPECT_TRUE(sut.looks_through_port());
  sut.port->normal = -Vector3d::UnitZ();
  EXPECT_FALSE(sut.looks_through_port());
  sut.port->normal = Vector3d(5, 0, 1).normalized();
  EXPECT_FALSE(sut.looks_through_port());
}

}  // namespace
}  // namespace tankrig
