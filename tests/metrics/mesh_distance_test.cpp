// Point-to-surface distance against closed forms and against all triangles, one by one.
#include "bench/metrics/mesh_distance.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>

#include "bench/metrics/closest_point.hpp"
#include "core/input_error.hpp"
#include "tests/metrics/shapes.hpp"

namespace tankrig {
namespace {

/// Distance to a segment and to a plane's inside, written unlike the library's.
double naive_distance(const TriangleMesh& mesh, const Vector3d& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Vector3d c[3] = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    const Vector3d n = (c[1] - c[0]).cross(c[2] - c[0]).normalized();
    const Vector3d foot = p - n.dot(p - c[0]) * n;
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const Vector3d side = c[(k + 1) % 3] - c[k];
      inside = inside && side.cross(foot - c[k]).dot(n) >= 0;
      const double s = std::clamp((p - c[k]).dot(side) / side.squaredNorm(), 0.0, 1.0);
      best = std::min(best, (p - c[k] - s * side).norm());
    }
    if (inside) best = std::min(best, std::abs(n.dot(p - c[0])));
  }
  return best;
}

/// A sphere with bumps: closed, not convex.
TriangleMesh bumpy_sphere(int levels) {
  TriangleMesh m = shapes::icosphere(0.1, levels);
  for (Vector3d& v : m.vertices) v *= 1 + 0.25 * std::sin(60 * v.x()) * std::cos(45 * v.y() + 30 * v.z());
  return m;
}

TEST(MeshDistance, EqualsTheNearestOfAllTriangles) {
  const TriangleMesh mesh = bumpy_sphere(3);
  const MeshDistance sut(mesh);
  constexpr unsigned kSeed = 1;
  RecordProperty("seed", kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> coordinate(-0.2, 0.2);
  for (int i = 0; i < 2000; ++i) {
    const double scale = i % 4 == 0 ? 10.0 : 1.0;
    const Vector3d p = scale * Vector3d(coordinate(random), coordinate(random), coordinate(random));
    const SurfaceDistance found = sut.at(p);
    EXPECT_NEAR(found.distance, naive_distance(mesh, p), 1e-12) << "seed " << kSeed << " point " << i;
    EXPECT_NEAR((found.nearest - p).norm(), found.distance, 1e-12);
  }
}

TEST(MeshDistance, IsExactToATenthOfAMicrometreNearTheSurface) {
  const MeshDistance sut(shapes::tank_box());
  for (double offset : {1e-7, 1e-6, 1e-4, 3e-3}) {
    EXPECT_NEAR(sut.at({0.0123, 0.0456, offset}).signed_distance, offset, 1e-12);
    EXPECT_NEAR(sut.at({0.070 - offset, 0.0456, -0.05}).signed_distance, -offset, 1e-12);
    EXPECT_NEAR(sut.at({0.070 + offset, 0.150 + offset, offset}).signed_distance, offset * std::sqrt(3.0), 1e-12);
  }
}

TEST(MeshDistance, SignsTheInsideOfABoxNegativeOnFacesEdgesAndCorners) {
  const MeshDistance sut(shapes::tank_box());
  ASSERT_TRUE(sut.closed());
  constexpr unsigned kSeed = 2;
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> stretch(-0.3, 1.3);
  const Eigen::AlignedBox3d box(shapes::kBoxLow, shapes::kBoxHigh);
  for (int i = 0; i < 5000; ++i) {
    const Vector3d share(stretch(random), stretch(random), stretch(random));
    const Vector3d p = box.min() + share.cwiseProduct(box.sizes());
    const double inside = std::min((p - box.min()).minCoeff(), (box.max() - p).minCoeff());
    const double expected = inside > 0 ? -inside : box.exteriorDistance(p);
    EXPECT_NEAR(sut.at(p).signed_distance, expected, 1e-12) << "seed " << kSeed << " point " << i;
  }
}

TEST(MeshDistance, SignsTheSurroundingsOfASharpSpike) {
  TriangleMesh spike;
  spike.vertices = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.012, 0}, {0.08, 0.05, 0.1}};
  spike.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const MeshDistance sut(spike);
  ASSERT_TRUE(sut.closed());
  ASSERT_GT(spike.signed_volume(), 0);
  constexpr unsigned kSeed = 6;
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> coordinate(-0.03, 0.13);
  std::uniform_real_distribution<double> share(0, 1);
  for (int i = 0; i < 5000; ++i) {
    Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    if (i % 2) p = share(random) * spike.vertices[3] + 0.01 * share(random) * shapes::random_unit(random);
    double highest = -1;  // above the faces' planes: positive outside a convex body
    for (const Eigen::Vector3i& t : spike.triangles) {
      const Vector3d& a = spike.vertices[t[0]];
      const Vector3d n = (spike.vertices[t[1]] - a).cross(spike.vertices[t[2]] - a).normalized();
      highest = std::max(highest, n.dot(p - a));
    }
    EXPECT_EQ(sut.at(p).signed_distance > 0, highest > 0) << "seed " << kSeed << " point " << i;
  }
}

TEST(MeshDistance, SignsABodyThatIsNotConvex) {
  const TriangleMesh mesh = bumpy_sphere(4);
  const MeshDistance sut(mesh);
  constexpr unsigned kSeed = 3;
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 300; ++i) {
    const Vector3d unit = shapes::random_unit(random);
    const double share = std::uniform_real_distribution<double>(0.3, 1.7)(random);
    // The body is star-shaped: the surface along `unit` is where the ray from the centre leaves its triangle.
    double surface = 0;
    for (const Eigen::Vector3i& t : mesh.triangles) {
      Eigen::Matrix3d corners;
      corners << mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]];
      const Vector3d weights = corners.inverse() * unit;
      if (weights.minCoeff() >= -1e-12) surface = 1 / weights.sum();
    }
    ASSERT_GT(surface, 0);
    const double d = sut.at(share * surface * unit).signed_distance;
    EXPECT_EQ(d > 0, share > 1) << "seed " << kSeed << " point " << i;
  }
}

TEST(MeshDistance, HasNoSignOnAnOpenMesh) {
  const MeshDistance sut(shapes::square(0.5));
  EXPECT_FALSE(sut.closed());
  EXPECT_DOUBLE_EQ(sut.at({0.1, 0.2, -0.3}).signed_distance, 0.3);
  EXPECT_DOUBLE_EQ(sut.at({1.5, 0.2, 0}).distance, 1.0);
}

TEST(MeshDistance, KeepsItsSignWhenTheMeshIsTurnedInsideOut) {
  TriangleMesh mesh = shapes::tank_box();
  for (Eigen::Vector3i& t : mesh.triangles) std::swap(t[0], t[1]);
  const MeshDistance sut(mesh);
  EXPECT_NEAR(sut.at({0, 0, -0.01}).signed_distance, -0.01, 1e-12);
}

TEST(MeshDistance, OfASphereIsWithinItsSagitta) {
  constexpr double kRadius = 0.1;
  const TriangleMesh mesh = shapes::icosphere(kRadius, 5);
  double longest = 0;
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
  // A facet's deepest point is its circumcentre; the circumradius is below edge / sqrt(3) * 1.1 on these near-regular
  // facets.
  const double circumradius = 1.1 * longest / std::sqrt(3.0);
  const double sagitta = kRadius - std::sqrt(kRadius * kRadius - circumradius * circumradius);
  const MeshDistance sut(mesh);
  constexpr unsigned kSeed = 4;
  std::mt19937_64 random(kSeed);
  for (double offset : {-0.03, -0.001, 0.002, 0.5}) {
    for (int i = 0; i < 500; ++i) {
      const double d = sut.at((kRadius + offset) * shapes::random_unit(random)).signed_distance;
      EXPECT_GE(d, offset - 1e-12);
      EXPECT_LE(d, offset + sagitta);
    }
  }
  EXPECT_LT(sagitta, 1e-4);
}

TEST(MeshDistance, OfABatchIsTheSameBitsForAnyNumberOfThreadsAndOrder) {
  const MeshDistance sut(bumpy_sphere(5));
  std::mt19937_64 random(5);
  std::vector<Vector3d> points;
  for (int i = 0; i < 20000; ++i)
    points.push_back(0.1 * shapes::random_unit(random) + 0.02 * shapes::random_unit(random));
  const auto many = sut.at(points);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<Vector3d> reversed(points.rbegin(), points.rend());
  const auto one = sut.at(reversed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(many[i].signed_distance, one[points.size() - 1 - i].signed_distance);
    ASSERT_EQ(many[i].triangle, one[points.size() - 1 - i].triangle);
  }
}

TEST(MeshDistance, SurvivesTrianglesWithoutArea) {
  TriangleMesh mesh = shapes::square(0.5);
  mesh.vertices.push_back({2, 0, 0});
  mesh.vertices.push_back({3, 0, 0});
  mesh.vertices.push_back({4, 0, 0});
  mesh.triangles.push_back({4, 5, 6});
  mesh.triangles.push_back({4, 4, 4});
  const MeshDistance sut(mesh);
  EXPECT_DOUBLE_EQ(sut.at({3.2, 1, 0}).distance, 1.0);
  EXPECT_DOUBLE_EQ(sut.at({5, 0, 0}).distance, 1.0);
  EXPECT_NEAR(sut.at({1.9, 0, 0}).distance, 0.1, 1e-12);
}

TEST(MeshDistance, RefusesAMeshWithoutTriangles) { EXPECT_THROW(MeshDistance(TriangleMesh{}), InputError); }

}  // namespace
}  // namespace tankrig
