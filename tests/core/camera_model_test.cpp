// The camera model against its own inverse and a hand-computed pixel.
#include "core/camera_model.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

CameraModel bowtech() {
  return {.width = 720,
          .height = 576,
          .fx = 626.08,
          .fy = 682.78,
          .cx = 368.93,
          .cy = 284.83,
          .k1 = -0.370,
          .k2 = 0.174,
          .p1 = -0.0016,
          .p2 = 0.0029,
          .k3 = 0};
}

TEST(CameraModel, PutsTheOpticalAxisOnThePrincipalPoint) {
  const auto pixel = bowtech().project({0, 0, 2});
  ASSERT_TRUE(pixel);
  EXPECT_LT((*pixel - Vector2d(368.93, 284.83)).norm(), 1e-12);
}

TEST(CameraModel, ProjectsAHandComputedDistortedPoint) {
  CameraModel sut = bowtech();
  sut.p1 = sut.p2 = 0;
  const double r2 = 0.25, radial = 1 - 0.370 * r2 + 0.174 * r2 * r2;
  const auto pixel = sut.project({0.3, 0.4, 1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 626.08 * 0.3 * radial + 368.93, 1e-9);
  EXPECT_NEAR(pixel->y(), 682.78 * 0.4 * radial + 284.83, 1e-9);
}

TEST(CameraModel, RayOfAPixelProjectsBackToIt) {
  const CameraModel sut = bowtech();
  for (double v = 0; v < sut.height; v += 23)
    for (double u = 0; u < sut.width; u += 31) {
      const auto pixel = sut.project(3.7 * sut.ray(u, v));
      ASSERT_TRUE(pixel);
      ASSERT_LT((*pixel - Vector2d(u, v)).norm(), 1e-9) << u << ", " << v;
    }
}

TEST(CameraModel, KnowsADistortionThatFoldsOver) {
  CameraModel sut = bowtech();
  EXPECT_TRUE(sut.invertible());
  sut.k1 = -2;
  EXPECT_FALSE(sut.invertible());
  sut.k1 = 1e30;
  EXPECT_FALSE(sut.invertible());
}

TEST(CameraModel, SeesNothingBehindIt) {
  EXPECT_FALSE(bowtech().project({0.1, 0.1, -1}));
  EXPECT_FALSE(bowtech().project({0.1, 0.1, 0}));
}

TEST(CameraModel, ImageCoversHalfAPixelAroundTheOutermostCentres) {
  const CameraModel sut = bowtech();
  EXPECT_TRUE(sut.contains({-0.5, -0.5}));
  EXPECT_TRUE(sut.contains({719.49, 575.49}));
  EXPECT_FALSE(sut.contains({719.5, 100}));
}

}  // namespace
}  // namespace tankrig
