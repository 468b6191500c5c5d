// The part of a box that a scan can see, where geometry gives the answer.
#include "bench/metrics/ceiling.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <time.h>

#include "bench/metrics/metrics.hpp"
#include "tests/metrics/shapes.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

using shapes::kBoxHigh;
using shapes::kBoxLow;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTop = 0.0420, kLongSide = 0.0480, kShortSide = 0.0224, kWhole = 0.2248;

CameraModel pinhole(double focal = 600) {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = focal;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

/// A camera at `eye` that looks at `target`.
CameraView looking(const Vector3d& eye, const Vector3d& target = {0, 0, -0.08}, double focal = 600) {
  CameraView view{pinhole(focal), Transform::Identity()};
  const Vector3d z = (target - eye).normalized();
  const Vector3d x = z.cross(std::abs(z.z()) > 0.99 ? Vector3d::UnitX() : Vector3d::UnitZ()).normalized();
  view.oMc.linear() << x, z.cross(x), z;
  view.oMc.translation() = eye;
  return view;
}

/// A vertical sheet at right angles to y that falls from a point 1 m above y, moving along y.
LaserPass falling_sheet(double from_y, double to_y, int frames, double half_angle = 0.6, double height = 1.0) {
  LaserPass pass;
  for (int i = 0; i < frames; ++i) {
    const double y = from_y + (to_y - from_y) * i / (frames - 1);
    pass.push_back({{Vector3d::UnitY(), -y}, {0, y, height}, -Vector3d::UnitZ(), half_angle});
  }
  return pass;
}

const TriangleMesh& mesh() {
  static const TriangleMesh box = shapes::tank_box();
  return box;
}

const std::vector<SurfaceSample>& samples() {
  static const std::vector<SurfaceSample> all = sample_surface(mesh(), 200'000);
  return all;
}

Ceiling ceiling(const CeilingViews& views) { return surface_ceiling(mesh(), samples(), views); }

/// Share of the triangles 2 * face and 2 * face + 1 (order -x +x -y +y -z +z) that is reachable.
double face_share(const Ceiling& c, unsigned face) {
  double part = 0, whole = 0;
  for (std::size_t i = 0; i < samples().size(); ++i) {
    if (samples()[i].triangle / 2 != face) continue;
    whole += samples()[i].weight;
    part += samples()[i].weight * c.reachable[i];
  }
  return part / whole;
}

TEST(Ceiling, OfACameraOverACornerIsExactlyThreeFaces) {
  const Ceiling c = ceiling({{looking({0.8, 0.9, 0.8})}, {}, {}, {}});
  EXPECT_NEAR(c.share, (kTop + kLongSide + kShortSide) / kWhole, 1e-6);
  for (unsigned face : {1u, 3u, 5u}) EXPECT_EQ(face_share(c, face), 1.0) << face;
  for (unsigned face : {0u, 2u, 4u}) EXPECT_EQ(face_share(c, face), 0.0) << face;
  EXPECT_LT(c.sigma, 1e-3);
}

TEST(Ceiling, LeavesOutAFaceSeenAtEightyDegrees) {
  // Far away, so that incidence is the same all over a face: 80 degrees to the long side's normal, 10 to the top's.
  const Vector3d eye = 50.0 * Vector3d(std::cos(80 * kDegree), 0, std::sin(80 * kDegree));
  const CameraView view = looking(eye, {0, 0, -0.08}, 30'000);
  const Ceiling strict = ceiling({{view}, {}, {}, {}});
  EXPECT_NEAR(strict.share, kTop / kWhole, 1e-6);
  CeilingViews wider{{view}, {}, {}, {}};
  wider.max_incidence = 85 * kDegree;
  EXPECT_NEAR(ceiling(wider).share, (kTop + kLongSide) / kWhole, 1e-6);
}

TEST(Ceiling, EndsWhereTheImageEnds) {
  // 1 m above the top, along -z: the image is 0.4 m x 0.2 m there; x of the camera is o's x or y, 300 mm do not fit in
  // 200.
  CameraView view{pinhole(), Transform::Identity()};
  view.camera.height = 120;
  view.camera.cy = 59.5;
  view.oMc.linear() << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  view.oMc.translation() = Vector3d(0, 0, 1);
  const Ceiling c = ceiling({{view}, {}, {}, {}});
  EXPECT_NEAR(face_share(c, 5), 120.0 / 600.0 / 0.300, 0.002);
}

TEST(Ceiling, IsCutByTheShadowOfAnotherBox) {
  // A screen 0.5 m above the top hides y > 0 from an eye at 1 m: on the top its edge's shadow is at y = 0.
  const TriangleMesh screen = shapes::box({-1, 0, 0.5}, {1, 1, 0.51});
  CeilingViews views{{looking({0, 0, 1})}, {}, {screen}, {}};
  EXPECT_NEAR(face_share(ceiling(views), 5), 0.5, 0.002);
  views.cameras = {looking({0, 0.05, 1})};
  const double edge = 0.05 - 0.05 / (1 - 0.51);  // of the shadow, cast by the screen's upper rim
  EXPECT_NEAR(face_share(ceiling(views), 5), (0.150 + edge) / 0.300, 0.002);
}

TEST(Ceiling, OfABodyWithAHollowLeavesOutWhatTheBodyHides) {
  TriangleMesh two = shapes::box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0});
  const TriangleMesh lid = shapes::box({-0.1, -0.1, 0.1}, {0.1, 0.1, 0.2});
  for (const Eigen::Vector3i& t : lid.triangles) two.triangles.push_back(t + Eigen::Vector3i::Constant(8));
  two.vertices.insert(two.vertices.end(), lid.vertices.begin(), lid.vertices.end());
  const Ceiling c = surface_ceiling(two, sample_surface(two, 50'000), {{looking({0, 0, 1.0})}, {}, {}, {}});
  EXPECT_NEAR(c.share, 0.04 / two.area(), 1e-3) << "the lid's top alone";
}

TEST(Ceiling, SeesNothingThroughTheGround) {
  CeilingViews views{{looking({0, 0, -1.2})}, {}, {}, Plane{Vector3d::UnitZ(), 0.160}};
  EXPECT_EQ(ceiling(views).share, 0.0);
  views.ground.reset();
  EXPECT_NEAR(ceiling(views).share, 0.0420 / kWhole, 1e-6) << "the bottom";
}

TEST(Ceiling, OfAStereoPairIsWhatBothEyesSee) {
  const CameraView left = looking({0.8, 0.9, 0.8}), right = looking({-0.8, 0.9, 0.8});
  const Ceiling both = ceiling({{left, right}, {}, {}, {}});
  EXPECT_NEAR(both.share, (kTop + kShortSide) / kWhole, 1e-6);
}

TEST(Ceiling, OfALaserScanIsWhatTheSheetSweeps) {
  // Frames from y = -0.04 to 0.04 in 17 steps of 5 mm light the top from -42.5 to 42.5 mm; vertical faces are edge-on.
  CeilingViews views{{looking({0, 0, 1})}, {falling_sheet(-0.04, 0.04, 17)}, {}, {}};
  EXPECT_NEAR(face_share(ceiling(views), 5), 0.085 / 0.300, 0.002);
  EXPECT_EQ(face_share(ceiling(views), 1), 0.0);
  views.laser.push_back(falling_sheet(-0.10, -0.06, 9));
  EXPECT_NEAR(face_share(ceiling(views), 5), 0.130 / 0.300, 0.002) << "two passes, 15 mm of darkness between them";
}

TEST(Ceiling, EndsWhereTheLaserFanEnds) {
  const double half_angle = std::atan(0.030);
  const Ceiling c = ceiling({{looking({0, 0, 1})}, {falling_sheet(-0.2, 0.2, 81, half_angle)}, {}, {}});
  EXPECT_NEAR(face_share(c, 5), 0.060 / 0.140, 0.004);
}

TEST(Ceiling, LeavesOutWhatTheLaserCannotReach) {
  // A screen between projector and object, out of the camera's sight, shadows y < 0.
  const TriangleMesh screen = shapes::box({-0.3, -0.3, 0.55}, {0.3, 0, 0.56});
  CeilingViews views{{looking({0, 0, 0.5})}, {falling_sheet(-0.2, 0.2, 81)}, {screen}, {}};
  EXPECT_NEAR(face_share(ceiling(views), 5), 0.5, 0.003);
  views.occluders.clear();
  EXPECT_EQ(face_share(ceiling(views), 5), 1.0);
}

TEST(Ceiling, LeavesOutFacesTheLaserGrazes) {
  // A projector far away at 80 degrees from the top's normal, in a sheet that moves along y: the top is seen but
  // grazed.
  LaserPass pass;
  for (int i = 0; i <= 80; ++i) {
    const double y = -0.2 + 0.005 * i;
    const Vector3d from(std::sin(80 * kDegree), 0, std::cos(80 * kDegree));
    pass.push_back({{Vector3d::UnitY(), -y}, 20 * from + Vector3d(0, y, 0), -from, 0.3});
  }
  const Ceiling c = ceiling({{looking({0.9, 0.3, 0.9})}, {pass}, {}, {}});
  EXPECT_EQ(face_share(c, 5), 0.0);
  EXPECT_EQ(face_share(c, 1), 1.0) << "the long side meets the light at 10 degrees";
}

TEST(Ceiling, OfAnOpenMeshIsSeenFromBothSides) {
  const TriangleMesh plate = shapes::square(0.05);
  const auto patches = sample_surface(plate, 5000);
  for (double z : {0.5, -0.5})
    EXPECT_EQ(surface_ceiling(plate, patches, {{looking({0, 0, z}, {0, 0, 0})}, {}, {}, {}}).share, 1.0) << z;
}

TEST(Ceiling, DoesNotFoldPointsOutsideAStronglyDistortedImageBackIntoIt) {
  CameraView view = looking({0, 0, 0.09}, {0, 0, 0}, 900);
  view.camera.k1 = -0.4;
  const auto inside = ceiling({{view}, {}, {}, {}});
  // The image's corner is 400 / 900 off the axis, 0.495 before distortion; beyond 0.913 the polynomial runs back to 0.
  for (std::size_t i = 0; i < samples().size(); ++i) {
    if (!inside.reachable[i]) continue;
    EXPECT_LT(samples()[i].p.head<2>().norm(), 0.09 * 0.5);
  }
}

TEST(Ceiling, BoundsTheCoverageOfThePerfectScanOfIt) {
  const Ceiling c = ceiling({{looking({0.8, 0.9, 0.8})}, {falling_sheet(-0.1, 0.0, 21)}, {}, {}});
  const ObjectSurface object(mesh());
  PointCloud cloud;
  for (std::size_t i = 0; i < samples().size(); ++i)
    if (c.reachable[i]) cloud.points.emplace_back().p = samples()[i].p;
  MetricThresholds t;
  t.max_incidence = 1.0;
  const Metrics all = evaluate(cloud, object, t, &c);
  for (const Coverage& coverage : all.coverage) {
    EXPECT_EQ(*coverage.of_ceiling, 1.0);
    EXPECT_GT(coverage.whole, c.share);
  }
  EXPECT_EQ(*all.coverage_ceiling, c.share);
  EXPECT_EQ(all.thresholds.max_incidence, 75 * kDegree) << "what the ceiling used";

  const Metrics none = evaluate(shapes::cloud_of({{0, 0.14, -0.1}}), object, t, &c);
  EXPECT_EQ(*none.headline().of_ceiling, 0.0);
}

TEST(Ceiling, OfNothingHasNoShareOfItself) {
  const Ceiling dark = ceiling({{looking({0, 0, 1})}, {falling_sheet(0.5, 0.6, 10)}, {}, {}});
  EXPECT_EQ(dark.share, 0.0);
  const Metrics m = evaluate(PointCloud{}, ObjectSurface(mesh()), {}, &dark);
  EXPECT_FALSE(m.headline().of_ceiling);
}

/// Time that processors have worked for this process.
double core_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

TEST(Ceiling, OfThreeHundredFramesTakesOneCoreASecondAtMostAndIsTheSameBitsForOneThread) {
  CeilingViews views{{looking({0.8, 0.9, 0.8})}, {falling_sheet(-0.2, 0.2, 300)}, {}, {}};
  const double begin = core_seconds();
  const Ceiling many = ceiling(views);
  const double took = core_seconds() - begin;
  RecordProperty("core_milliseconds", static_cast<int>(1000 * took));
  EXPECT_LT(took, 1.0 * testing_support::kSlowness);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(many.reachable, ceiling(views).reachable);
}

}  // namespace
}  // namespace tankrig
