// Filters, normals, floors and meshes of clouds whose truth is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bench/metrics/mesh_distance.hpp"
#include "core/input_error.hpp"
#include "reconstruction/pointcloud/cloud_filters.hpp"
#include "reconstruction/pointcloud/cloud_mesh.hpp"
#include "reconstruction/pointcloud/floor.hpp"
#include "reconstruction/pointcloud/normals.hpp"
#include "tests/metrics/shapes.hpp"
#include "tests/pointcloud/seen_prism.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

/// A level floor of 0.6 m at height `z`, 4 mm apart, with noise of 0.5 mm.
PointCloud floor_at(double z) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.0005);
  PointCloud cloud{"o", {}, 0};
  for (int i = 0; i < 150; ++i)
    for (int k = 0; k < 150; ++k) {
      CloudPoint point;
      point.p = {0.004 * i - 0.3, 0.004 * k - 0.3, z + noise(random)};
      cloud.points.push_back(point);
    }
  return cloud;
}

PointCloud box_seen() { return shapes::seen(shapes::tank_box(), {1, 1, 0.6}, 0.0003, 1); }

PointCloud together(PointCloud a, const PointCloud& b) {
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  return a;
}

TEST(CloudFilters, CropKeepsWhatIsInsideAndItsProvenance) {
  PointCloud cloud = box_seen();
  for (std::size_t i = 0; i < cloud.points.size(); ++i) cloud.points[i].frame = static_cast<std::int32_t>(i);
  const Eigen::AlignedBox3d box(Vector3d(-1, -1, -0.1), Vector3d(0.05, 1, 1));
  const PointCloud inside = cropped(cloud, box), outside = cropped(cloud, box, true);
  EXPECT_EQ(inside.points.size() + outside.points.size(), cloud.points.size());
  ASSERT_FALSE(inside.points.empty());
  for (const CloudPoint& point : inside.points) {
    EXPECT_TRUE(box.contains(point.p));
    EXPECT_EQ(cloud.points[static_cast<std::size_t>(point.frame)].p, point.p);
  }
  for (const CloudPoint& point : outside.points) EXPECT_FALSE(box.contains(point.p));
}

TEST(CloudFilters, VoxelGridGivesTheMeanOfEachCube) {
  PointCloud cloud{"b", {}, 2};
  for (const double x : {0.001, 0.003, 0.013})
    for (const float intensity : {0.2f, 0.4f}) {
      CloudPoint point;
      point.p = {x, 0.001, 0.001};
      point.intensity = intensity;
      point.frame = 4;
      cloud.points.push_back(point);
    }
  PointCloud grid = voxel_grid(cloud, 0.010);
  ASSERT_EQ(grid.points.size(), 2u);
  std::ranges::sort(grid.points, {}, [](const CloudPoint& p) { return p.p.x(); });
  EXPECT_NEAR(grid.points[0].p.x(), 0.002, 1e-7);
  EXPECT_NEAR(grid.points[1].p.x(), 0.013, 1e-7);
  EXPECT_NEAR(grid.points[0].intensity, 0.3, 1e-6);
  EXPECT_EQ(grid.points[0].frame, -1) << "a mean is of no one frame";
  EXPECT_EQ(grid.frame, "b");
  EXPECT_EQ(grid.invalid, 2u);
  EXPECT_EQ(thinned(cloud, 0.010).points.size(), 2u);
  EXPECT_EQ(thinned(cloud, 0.010).points[0].frame, 4) << "one of its own";
  EXPECT_THROW(voxel_grid(together(cloud, floor_at(0)), 1e-5), InputError) << "too many cubes";
}

TEST(CloudFilters, OutliersGoAndTheSurfaceStays) {
  const PointCloud surface = box_seen();
  PointCloud cloud = surface;
  for (int i = 0; i < 40; ++i) {
    CloudPoint lonely;
    lonely.p = {0.3 + 0.03 * i, -0.4, 0.2 + 0.02 * (i % 7)};
    lonely.frame = 99;
    cloud.points.push_back(lonely);
  }
  const PointCloud clean = without_outliers(cloud);
  EXPECT_TRUE(std::ranges::none_of(clean.points, [](const CloudPoint& p) { return p.frame == 99; }));
  EXPECT_GT(clean.points.size(), surface.points.size() * 97 / 100);
}

TEST(CloudFilters, LeaveAnEmptyCloudEmpty) {
  const PointCloud none;
  EXPECT_TRUE(cropped(none, Eigen::AlignedBox3d(Vector3d::Zero(), Vector3d::Ones())).points.empty());
  EXPECT_TRUE(voxel_grid(none, 0.01).points.empty());
  EXPECT_TRUE(without_outliers(none).points.empty());
  EXPECT_TRUE(with_normals(none, 0.01, Vector3d::Zero()).points.empty());
  EXPECT_FALSE(find_floor(none, Vector3d::UnitZ()));
}

TEST(Normals, OfASpherePointOutwardsToTheCamera) {
  const Vector3d eye(0, 0, 2);
  PointCloud sphere = shapes::seen(shapes::icosphere(0.1, 5), eye, 0, 1);
  CloudPoint lonely;
  lonely.p = {1, 1, 1};
  sphere.points.push_back(lonely);
  const PointCloud found = with_normals(sphere, kNormalRadius, eye);
  EXPECT_EQ(found.points.size(), sphere.points.size() - 1) << "a lonely point has none";
  double worst = 1;
  for (const CloudPoint& point : found.points)
    worst = std::min(worst, point.normal.cast<double>().dot(point.p.normalized()));
  EXPECT_GT(worst, std::cos(from_degrees(6)));
}

TEST(Floor, IsThePlaneUnderTheObjectNotItsTop) {
  const Transform tilt = make_transform_rpy({0, 0, 0}, {0.05, -0.03, 0});
  const PointCloud cloud = transformed(tilt, together(box_seen(), floor_at(-0.16)), "o");
  const auto floor = find_floor(cloud, Vector3d::UnitZ());
  ASSERT_TRUE(floor);
  EXPECT_LT(to_degrees(std::acos(floor->plane.normal.dot(tilt.linear() * Vector3d::UnitZ()))), 0.1);
  EXPECT_NEAR(floor->plane.distance(tilt * Vector3d(0, 0, -0.16)), 0, 2e-4);
  EXPECT_NEAR(floor->rms_m, 0.0005, 2e-4);
  EXPECT_GE(floor->points.size(), floor_at(0).points.size());
}

TEST(Floor, ThereIsNoneUnderABoxThatWasCutOut) {
  EXPECT_FALSE(find_floor(box_seen(), Vector3d::UnitZ()));
  EXPECT_FALSE(find_floor(floor_at(0), Vector3d::UnitX())) << "a wall is no floor";
}

TEST(CloudMesh, OfASphereIsTheSphereInEveryFormat) {
  const TemporaryFolder folder;
  PointCloud sphere = shapes::seen(shapes::icosphere(0.1, 5), {0, 0, 5}, 0, 1);
  const PointCloud back = shapes::seen(shapes::icosphere(0.1, 5), {0, 0, -5}, 0, 2);
  sphere = thinned(together(sphere, back), 0.003);
  const CloudMesh poisson = poisson_mesh(sphere, 6, 0), greedy = greedy_mesh(sphere, 0.012);
  for (const char* name : {"a.stl", "a.obj", "a.ply"}) {
    write_mesh(folder.path() / name, poisson);
    const TriangleMesh read = read_mesh(folder.path() / name);
    EXPECT_EQ(read.triangles.size(), poisson.triangles.size()) << name;
    EXPECT_NEAR(read.area(), 4 * std::numbers::pi * 0.01, 0.002) << name;
    EXPECT_THAT(folder.read(name), HasSubstr("frame o")) << name;
  }
  for (const Eigen::Vector3f& v : greedy.vertices) EXPECT_NEAR(v.norm(), 0.1, 1e-3) << "the points themselves";
  EXPECT_GT(greedy.triangles.size(), sphere.points.size());
}

TEST(CloudMesh, TrimmedPoissonStaysNearThePoints) {
  const PointCloud half = shapes::seen(shapes::icosphere(0.1, 5), {0, 0, 5}, 0, 1);
  const CloudMesh closed = poisson_mesh(half, 6, 0), trimmed = poisson_mesh(half, 6, 0.005);
  EXPECT_LT(trimmed.triangles.size(), closed.triangles.size());
  for (const Eigen::Vector3f& v : trimmed.vertices) EXPECT_GT(v.z(), 0) << "nothing is invented behind";
}

TEST(CloudMesh, RefusesWhatItCannotDo) {
  const TemporaryFolder folder;
  EXPECT_THROW(poisson_mesh(floor_at(0), 6, 0), InputError) << "no normals";
  EXPECT_THROW(greedy_mesh(floor_at(0), 0.01), InputError);
  EXPECT_THROW(write_mesh(folder.path() / "a.stl", CloudMesh{"o", {}, {}}), InputError) << "nothing to write";
  EXPECT_THROW(write_mesh(folder.path() / "a.dae", CloudMesh{"o", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}),
               InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace tankrig
