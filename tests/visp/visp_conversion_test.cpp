// A transform means the same in ViSP as in ours, and comes back whole.
#include "calibration/visp/module/visp_conversion.hpp"

#include <gtest/gtest.h>
#include <visp3/core/vpColVector.h>

#include <random>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

Transform some_transform(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-3, 3);
  const auto vector = [&] { return Vector3d(number(random), number(random), number(random)); };
  return make_transform_rpy(vector(), vector());
}

TEST(VispConversion, GivesBackWhatItGot) {
  for (unsigned seed = 1; seed <= 100; ++seed)
    EXPECT_TRUE(from_visp(to_visp(some_transform(seed))).isApprox(some_transform(seed), 1e-14)) << "seed " << seed;
}

TEST(VispConversion, MovesPointsAndMultipliesAsOursDoes) {
  const Transform aMb = some_transform(1), bMc = some_transform(2);
  const Vector3d pc(0.3, -0.2, 1.1), pa = aMb * bMc * pc;
  vpColVector p(4);
  for (unsigned k = 0; k < 3; ++k) p[k] = pc[static_cast<int>(k)];
  p[3] = 1;
  const vpColVector moved = to_visp(aMb) * to_visp(bMc) * p;
  for (unsigned k = 0; k < 3; ++k) EXPECT_NEAR(moved[k], pa[static_cast<int>(k)], 1e-12);
  EXPECT_TRUE(from_visp(to_visp(aMb).inverse()).isApprox(aMb.inverse(), 1e-12));
}

TEST(VispConversion, MendsARotationThatRoundingHasBent) {
  vpHomogeneousMatrix bent = to_visp(some_transform(3));
  bent[0][1] += 1e-6;
  const Transform mended = from_visp(bent);
  EXPECT_LT((mended.linear().transpose() * mended.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_TRUE(mended.isApprox(some_transform(3), 1e-5));
}

TEST(VispConversion, RefusesWhatIsNoRotation) {
  vpHomogeneousMatrix scaled = to_visp(some_transform(4)), mirrored = to_visp(Transform::Identity());
  for (unsigned k = 0; k < 3; ++k) scaled[k][0] *= 1.01;
  mirrored[2][2] = -1;
  EXPECT_THROW(from_visp(scaled), InputError);
  EXPECT_THROW(from_visp(mirrored), InputError);
}

}  // namespace
}  // namespace tankrig
