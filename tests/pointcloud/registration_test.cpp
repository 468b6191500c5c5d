// Clouds find their place on surfaces and on each other, and say where they have none.
#include "reconstruction/pointcloud/registration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/metrics/alignment.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "reconstruction/pointcloud/turned_views.hpp"
#include "tests/metrics/shapes.hpp"
#include "tests/pointcloud/seen_prism.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using shapes::mesh_of;
using shapes::seen;
using testing::HasSubstr;

const Vector3d kEye{0.9, 0.3, 0.6};
constexpr double kNoise = 0.0003;

Transform turned_about_z(double degrees) {
  return Transform(Eigen::AngleAxisd(from_degrees(degrees), Vector3d::UnitZ()));
}

/// What the camera sees once the object has been turned, in the frame of the tank.
PointCloud view_after_turn(const TriangleMesh& mesh, double degrees, unsigned seed) {
  const Transform turn = turned_about_z(degrees);
  return transformed(turn, seen(mesh, turn.inverse() * kEye, kNoise, seed), "w");
}

std::string refusal(const std::vector<TurnedView>& views) {
  return message_of<InputError>([&] { merge_views(nullptr, views, {}); });
}

TEST(Registration, FindsAKnownMotionOntoTheMesh) {
  const ObjectSurface object(mesh_of(shapes::odd_prism()));
  const Transform motion = make_transform_rpy({0.006, -0.009, 0.004}, {0.02, -0.015, 0.03});
  for (const unsigned seed : {1u, 2u, 3u}) {
    const PointCloud moved = transformed(motion.inverse(), seen(object.mesh(), kEye, kNoise, seed), "o");
    const Registration found = register_cloud(surface_cloud(object), moved, Transform::Identity());
    const Transform off = motion.inverse() * found.aMb;
    EXPECT_LT(off.translation().norm(), 1e-4) << "seed " << seed;
    EXPECT_LT(to_degrees(rotation_angle(off)), 0.03) << "seed " << seed;
    EXPECT_EQ(found.free, 0);
    EXPECT_NEAR(found.rms_m, kNoise, 0.3 * kNoise);
    EXPECT_EQ(doubt(found, 0.5), "");
  }
}

TEST(Registration, CountsTheFreedomsThatAShapeLeavesOpen) {
  const auto free = [](const TriangleMesh& mesh, const PointCloud& cloud) {
    return register_cloud(surface_cloud(ObjectSurface(mesh)), cloud, Transform::Identity()).free;
  };
  const TriangleMesh plane = shapes::square(0.15), sphere = shapes::icosphere(0.1, 4),
                     tube = mesh_of(shapes::round_prism(0.1));
  EXPECT_EQ(free(plane, seen(plane, {0, 0, 1}, kNoise, 1)), 3);
  EXPECT_EQ(free(sphere, seen(sphere, {0, 0, 5}, kNoise, 1)), 3);
  EXPECT_EQ(free(tube, seen(tube, {5, 0, 0.08}, kNoise, 1)), 2) << "turns and slides";
  EXPECT_EQ(free(tube, seen(tube, {2, 0, 1}, kNoise, 1)), 1) << "its top holds it from sliding";
  const TriangleMesh box = shapes::tank_box();
  EXPECT_EQ(free(box, seen(box, {1, 1, 0.6}, kNoise, 1)), 0);
  EXPECT_EQ(free(box, seen(box, {0.01, 1, 0.6}, kNoise, 1)), 1) << "two faces slide along their edge";
}

TEST(Registration, RefusesASurfaceWithoutNormals) {
  PointCloud cloud{"o", std::vector<CloudPoint>(10), 0};
  EXPECT_THROW(register_cloud(cloud, cloud, Transform::Identity()), InputError);
}

TEST(AlignedScore, TakesThePosesErrorOffAndLeavesTheRest) {
  const ObjectSurface object(shapes::tank_box());
  const Transform wrong_pose = make_transform_rpy({0.003, -0.002, 0.004}, {0.01, 0, 0.01});
  const PointCloud cloud = transformed(wrong_pose, seen(object.mesh(), {1, 1, 0.6}, kNoise, 5), "o");
  const MetricThresholds thresholds;
  const Metrics given = evaluate(cloud, object, thresholds);
  const AlignedScore aligned = evaluate_aligned(cloud, object, thresholds, given);
  ASSERT_TRUE(aligned.metrics) << aligned.doubt;
  EXPECT_GT(given.error->mean, 0.002);
  EXPECT_NEAR(aligned.metrics->error->mean, kNoise * std::sqrt(2 / std::numbers::pi), 0.2 * kNoise);
  EXPECT_LT(((aligned.registration.aMb * wrong_pose).translation()).norm(), 2e-4);
}

TEST(AlignedScore, IsRefusedWhereOnlyAFaceIsSeen) {
  const ObjectSurface object(shapes::tank_box());
  const PointCloud top = seen(object.mesh(), {0, 0, 3}, kNoise, 6);
  const MetricThresholds thresholds;
  const AlignedScore aligned = evaluate_aligned(top, object, thresholds, evaluate(top, object, thresholds));
  EXPECT_FALSE(aligned.metrics);
  EXPECT_THAT(aligned.doubt, HasSubstr("of the 6 freedoms open"));
}

TEST(Merge, TwoViewsOfATurnedObjectCoverMoreThanOneCanSee) {
  const ObjectSurface object(mesh_of(shapes::odd_prism()));
  constexpr double kTurn = -47;
  for (const unsigned seed : {1u, 3u, 5u}) {
    const PointCloud first = view_after_turn(object.mesh(), 0, seed),
                     second = view_after_turn(object.mesh(), kTurn, seed + 1);
    const MergedViews merged = merge_views(nullptr, {{"first", first}, {"second", second}}, {});
    const Transform off = turned_about_z(kTurn) * merged.placed[1].aMb;
    EXPECT_LT(off.translation().norm(), 3e-4) << "seed " << seed;
    EXPECT_LT(to_degrees(rotation_angle(off)), 0.1) << "seed " << seed;
    EXPECT_EQ(merged.cloud.frame, "w");
    EXPECT_GT(evaluate(merged.cloud, object, {}).headline().whole, evaluate(first, object, {}).headline().whole + 0.05)
        << "seed " << seed;
  }
}

TEST(Merge, ViewsLaidOnTheMeshCoverEverySideOfABox) {
  const ObjectSurface object(shapes::tank_box());
  const PointCloud surface = surface_cloud(object);
  std::vector<TurnedView> views;
  for (const double turn : {0.0, 180.0}) {
    const Vector3d eye = turned_about_z(-turn) * Vector3d(1, 1, 0.6);
    views.push_back({"view", transformed(turned_about_z(2), seen(object.mesh(), eye, kNoise, 3), "o"), true});
  }
  const MergedViews merged = merge_views(&surface, views, {});
  EXPECT_GT(evaluate(merged.cloud, object, {}).headline().whole, 0.8) << "all but the bottom";
  EXPECT_LT(evaluate(merged.cloud, object, {}).error->mean, kNoise);
}

TEST(Merge, RefusesWhatTheShapeLeavesOpen) {
  const auto views = [](const TriangleMesh& mesh, double turn) {
    return std::vector<TurnedView>{{"first", view_after_turn(mesh, 0, 1)}, {"second", view_after_turn(mesh, turn, 2)}};
  };
  EXPECT_THAT(refusal(views(mesh_of(shapes::round_prism(0.1)), 60)), HasSubstr("second: the shape leaves 1 of the 6"));
  EXPECT_THAT(refusal(views(shapes::icosphere(0.1, 4), 60)), HasSubstr("second: the shape leaves 3 of the 6"));
  EXPECT_NE(refusal(views(mesh_of(shapes::box_prism(0.2, 0.2)), 90)), "no error");
  EXPECT_THAT(refusal(views(mesh_of(shapes::box_prism(0.14, 0.3)), 180)), HasSubstr("second: "));
}

TEST(Merge, RefusesTooLittleOverlap) {
  const TriangleMesh prism = mesh_of(shapes::odd_prism());
  const PointCloud front = seen(prism, {2, 0, 0.08}, kNoise, 1), back = seen(prism, {-2, 0, 0.08}, kNoise, 2);
  EXPECT_THAT(refusal({{"front", front, true}, {"back", back, true}}), HasSubstr("back: too little overlap"));
}

}  // namespace
}  // namespace tankrig
