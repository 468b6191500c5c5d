// How far a laser's plane places the stripe off its board: planes off by a known angle, and points that are no stripe of it.
#include "calibration/laser_plane/stripe_stretches.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace tankrig {
namespace {

using testing::Each;
using testing::SizeIs;

/// A board one metre off, facing the camera, and the stripe of a sheet that comes from above across its middle.
struct Stripe {
  static constexpr double kRange = 1,
                          kSource =
                              -0.4;  ///< of the board along z; of the projector along y, in the camera's z = 0 [m]

  CameraModel camera{720, 576, 626.08, 682.78, 368.93, 284.83, -0.37, 0.174, -0.0016, 0.0029, 0};
  Transform cMt = make_transform({0, 0, kRange}, {1, 0, 0, 0});  // its z towards the camera
  std::vector<PlacedStripePoint> points;

  Stripe() {
    for (int i = 0; i < 100; ++i) points.push_back({{-0.2 + 0.004 * i, 0, kRange}, 1e-4});
  }
  /// The sheet turned about the projector's line, away from where it hits the board at y = 0.
  static Plane plane(double turned) {
    const double angle = std::atan2(-kSource, kRange) + turned;
    const Vector3d normal(0, std::cos(angle), -std::sin(angle));
    return {normal, -normal.y() * kSource};
  }
};

TEST(StripeStretches, LieOnTheBoardWhereThePlaneIsRight) {
  const Stripe stripe;
  const auto off = stretches_off(stripe.camera, Stripe::plane(0), stripe.cMt, stripe.points);
  ASSERT_THAT(off, SizeIs(3));  // of 32 points each; a rest of four is not judged
  EXPECT_THAT(off, Each(testing::DoubleNear(0, 1e-9)));
}

TEST(StripeStretches, AreOffByWhatAPlanesAngleComesToAlongTheLinesOfSight) {
  const Stripe stripe;
  for (const double turned : {-0.01, 0.001, 0.02}) {
    const auto off = stretches_off(stripe.camera, Stripe::plane(turned), stripe.cMt, stripe.points);
    ASSERT_THAT(off, SizeIs(3));
    // Lines of sight through y = 0 meet the sheet where it comes to y = 0, at this range.
    const double range = -Stripe::kSource / std::tan(std::atan2(-Stripe::kSource, Stripe::kRange) + turned);
    EXPECT_THAT(off, Each(testing::DoubleNear(Stripe::kRange - range, 1e-9)));
    EXPECT_GT(std::abs(off[0]), 2 * std::abs(turned));  // more than beside the sheet: it is met at a slant
  }
}

TEST(StripeStretches, LookThroughAFlatPort) {
  Stripe stripe;
  stripe.camera.port = FlatPort{0.03, 0.01, Vector3d(0.02, -0.03, 1).normalized()};
  EXPECT_THAT(stretches_off(stripe.camera, Stripe::plane(0), stripe.cMt, stripe.points),
              Each(testing::DoubleNear(0, 1e-9)));
  // The line of sight in the water comes from no point in common: it is followed from pane to sheet.
  const Plane turned = Stripe::plane(0.01);
  for (const PlacedStripePoint& point : stripe.points) {
    const Vector2d pixel = *stripe.camera.project(point.p);
    const ViewingRay sight = stripe.camera.sight(pixel.x(), pixel.y());
    const Vector3d met = sight.at(-turned.distance(sight.origin) / turned.normal.dot(sight.direction));
    const std::vector<PlacedStripePoint> alone(kStretch, point);
    EXPECT_THAT(stretches_off(stripe.camera, turned, stripe.cMt, alone),
                testing::ElementsAre(testing::DoubleNear(Stripe::kRange - met.z(), 1e-8)));
  }
}

std::vector<double> with_junk(std::size_t stretches, double off, std::size_t junk, double junk_off) {
  std::vector<double> all(stretches, off);
  for (std::size_t i = 0; i < junk; ++i) all.push_back(i % 2 ? junk_off : -junk_off);
  return all;
}

TEST(StripeStretches, LeaveOutJunkUpToAFewPercent) {
  EXPECT_NEAR(rms_of_stretches(with_junk(95, 0.5e-3, 5, 0.030)).value(), 0.5e-3, 1e-12);
  EXPECT_NEAR(rms_of_stretches(with_junk(95, -0.5e-3, 5, 0.010)).value(), 0.5e-3, 1e-12);
}

TEST(StripeStretches, CountMoreJunkThanThat) {
  EXPECT_NEAR(rms_of_stretches(with_junk(94, 0.5e-3, 6, 0.030)).value(), std::sqrt((94 * 0.25e-6 + 6 * 900e-6) / 100),
              1e-12);
  EXPECT_NEAR(rms_of_stretches(with_junk(0, 0, 4, 0.020)).value(), 0.020, 1e-12);
}

TEST(StripeStretches, CountWhatIsNearerThanJunk) {
  EXPECT_NEAR(rms_of_stretches(with_junk(99, 0, 1, 9.9e-3)).value(), 0.99e-3, 1e-12);
}

TEST(StripeStretches, SayNothingOfNone) { EXPECT_FALSE(rms_of_stretches({})); }

}  // namespace
}  // namespace tankrig
