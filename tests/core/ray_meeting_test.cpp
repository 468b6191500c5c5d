// Two rays whose meeting is known.
#include "core/ray_meeting.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

TEST(RayMeeting, IsThePointThatBothGoThrough) {
  const Vector3d p(0.3, -0.2, 1.1), a(0, 0, 0), b(0.12, 0.01, -0.02);
  EXPECT_LT((meeting(a, (p - a).normalized(), b, 3 * (p - b)) - p).norm(), 1e-12) << "whatever the rays' lengths";
}

TEST(RayMeeting, IsHalfwayBetweenRaysThatMissEachOther) {
  const Vector3d a(-1, 0, 0.01), u(1, 0, 0), b(0.5, -2, -0.03), v(0, 1, 0);
  EXPECT_LT((meeting(a, u, b, v) - Vector3d(0.5, 0, -0.01)).norm(), 1e-12);
}

}  // namespace
}  // namespace tankrig
