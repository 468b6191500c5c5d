// Transforms and planes keep the rule pa = aMb * pb.
#include "core/frames.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

Transform random_transform(std::mt19937& rng) {
  std::normal_distribution<double> n;
  const Eigen::Vector4d q = Eigen::Vector4d(n(rng), n(rng), n(rng), n(rng)).normalized();
  return make_transform({n(rng), n(rng), n(rng)}, q);
}

TEST(Frames, APlaneMovesWithItsPoints) {
  constexpr unsigned kSeed = 7;
  RecordProperty("seed", kSeed);
  std::mt19937 rng(kSeed);
  std::normal_distribution<double> n;
  for (int i = 0; i < 100; ++i) {
    const Transform aMb = random_transform(rng);
    const Plane plane_b{Vector3d(n(rng), n(rng), n(rng)).normalized(), n(rng)};
    const Vector3d p_b(n(rng), n(rng), n(rng));
    EXPECT_NEAR((aMb * plane_b).distance(aMb * p_b), plane_b.distance(p_b), 1e-12);
  }
}

TEST(Frames, QuaternionComesBackFromTheTransform) {
  std::mt19937 rng(11);
  for (int i = 0; i < 100; ++i) {
    const Transform aMb = random_transform(rng);
    EXPECT_TRUE(make_transform(aMb.translation(), quaternion_xyzw(aMb)).isApprox(aMb, 1e-12));
  }
}

TEST(Frames, RollPitchYawTurnAboutTheFixedAxesInThatOrder) {
  const Transform m = make_transform_rpy({0, 0, 0}, {M_PI / 2, 0, M_PI / 2});
  EXPECT_LT((m * Vector3d::UnitY() - Vector3d::UnitZ()).norm(), 1e-12);  // roll lifts y to z, yaw leaves it
  EXPECT_LT((m * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-12);
}

TEST(Frames, RefusesAQuaternionThatIsNotUnit) {
  EXPECT_THROW(make_transform({0, 0, 0}, {0, 0, 0, 2}), InputError);
  EXPECT_THROW(make_transform({0, 0, 0}, {0, 0, 0, std::nan("")}), InputError);
}

}  // namespace
}  // namespace tankrig
