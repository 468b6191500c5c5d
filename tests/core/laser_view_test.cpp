// Laser planes in a camera's view: a plane in millimetres is told from every plane that a tank's scanner can have.
#include "core/laser_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tankrig {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr CameraModel kCamera{640, 480, 765, 763, 316, 237, -0.37, 0.16, 0.001, 0, 0};

/// The plane through `at` and the camera's x axis moved there, turned by `angle` from the optical axis.
Plane sheet(double baseline, double angle) {
  const Vector3d normal(std::cos(angle), 0, std::sin(angle));
  return {normal, -normal.dot(Vector3d(baseline, 0, 0))};
}

Plane in_millimetres(const Plane& plane) { return {plane.normal, 1e3 * plane.offset}; }

/// By every pixel's own ray.
std::optional<double> nearest_of_all_pixels(const CameraModel& camera, const Plane& plane) {
  std::optional<double> nearest;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vector3d ray = camera.ray(x, y);
      const double depth = -plane.offset / plane.normal.dot(ray) * ray.z();
      if (depth > 0 && !(nearest && *nearest < depth)) nearest = depth;
    }
  return nearest;
}

TEST(LaserView, NearestSeenIsThatOfAllPixels) {
  constexpr unsigned kSeed = 7;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 rng(kSeed);
  std::normal_distribution<double> normal;
  int unseen = 0;
  for (int i = 0; i < 20; ++i) {
    const Plane plane{Vector3d(normal(rng), normal(rng), 0.2 * normal(rng)).normalized(), normal(rng)};
    const auto expected = nearest_of_all_pixels(kCamera, plane), found = nearest_seen(kCamera, plane);
    ASSERT_EQ(found.has_value(), expected.has_value()) << "seed " << kSeed << ", plane " << i;
    if (found) {
      EXPECT_NEAR(*found, *expected, 0.01 * *expected) << "seed " << kSeed << ", plane " << i;
    } else {
      ++unseen;
    }
  }
  EXPECT_LT(unseen, 20);
}

TEST(LaserView, NoPlaneOfATanksScannerIsRefused) {
  for (const double baseline : {0.02, 0.04, 0.1, 0.5, 1.0, 2.0, 5.0})
    for (const double range : {0.3, 1.0, 3.0, 10.0}) {
      const Plane plane = sheet(baseline, std::atan2(baseline, range));  // meets the optical axis there
      EXPECT_THAT(out_of_view(kCamera, std::vector{plane}), IsEmpty()) << baseline << " m beside, meets at " << range;
      EXPECT_THAT(out_of_view(kCamera, std::vector{Plane{-plane.normal, -plane.offset}}), IsEmpty()) << "other side";
    }
}

TEST(LaserView, APlaneInMillimetresIsQuestioned) {
  for (const double baseline : {0.02, 0.04, 0.1, 0.5, 1.0, 2.0})
    for (const double range : {0.3, 1.0, 3.0, 10.0}) {
      const Plane plane = in_millimetres(sheet(baseline, std::atan2(baseline, range)));
      EXPECT_THAT(out_of_view(kCamera, std::vector{plane}), HasSubstr("looks like millimetres, expected metres"))
          << baseline << " m beside, meets at " << range;
    }
  EXPECT_THAT(out_of_view(kCamera, std::vector{in_millimetres(sheet(0.016, 0))}),
              HasSubstr("found d = -16, a plane that is 33.7 m away"));
}

TEST(LaserView, ASweepMayBeginAndEndOutsideTheImage) {
  const Plane seen = sheet(0.3, 0.3), behind = sheet(0.3, -1.4);
  ASSERT_FALSE(nearest_seen(kCamera, behind));
  EXPECT_THAT(out_of_view(kCamera, std::vector{behind, seen, behind}), IsEmpty());
  EXPECT_THAT(out_of_view(kCamera, std::vector{behind, behind}), HasSubstr("nowhere in front of the camera"));
  EXPECT_THAT(out_of_view(kCamera, std::vector{behind, in_millimetres(seen)}), HasSubstr("millimetres"));
  EXPECT_THAT(out_of_view(kCamera, {}), IsEmpty());
}

}  // namespace
}  // namespace tankrig
