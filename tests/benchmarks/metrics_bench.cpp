// Point-to-surface distance against Open3D's RaycastingScene in the same run, and the cost of a whole score.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "bench/metrics/metrics.hpp"
#include "tests/metrics/shapes.hpp"

#ifdef TANKRIG_HAS_OPEN3D
#include <open3d/core/Tensor.h>
#include <open3d/t/geometry/RaycastingScene.h>
#endif

namespace tankrig {
namespace {

constexpr int kPoints = 100'000;

/// A torus with ripples, 448 x 224 x 2 = 200 704 triangles, about the size of the tank's box.
const TriangleMesh& rippled_torus() {
  static const TriangleMesh torus = [] {
    constexpr int kAround = 448, kAcross = 224;
    TriangleMesh m;
    for (int i = 0; i < kAround; ++i)
      for (int j = 0; j < kAcross; ++j) {
        const double a = 2 * std::numbers::pi * i / kAround, b = 2 * std::numbers::pi * j / kAcross;
        const double tube = 0.04 + 0.003 * std::sin(9 * a) * std::cos(5 * b);
        const double radius = 0.1 + tube * std::cos(b);
        m.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), tube * std::sin(b));
      }
    for (int i = 0; i < kAround; ++i)
      for (int j = 0; j < kAcross; ++j) {
        const int i1 = (i + 1) % kAround, j1 = (j + 1) % kAcross;
        const auto at = [](int u, int v) { return u * kAcross + v; };
        m.triangles.emplace_back(at(i, j), at(i1, j), at(i1, j1));
        m.triangles.emplace_back(at(i, j), at(i1, j1), at(i, j1));
      }
    return m;
  }();
  return torus;
}

/// Points within `reach` of vertices: along the surface as a scan gives them, or in random order.
[[maybe_unused]] std::vector<Vector3d> points_near(double reach, bool shuffled) {
  constexpr unsigned kSeed = 1;
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> offset(-reach, reach);
  const auto& vertices = rippled_torus().vertices;
  std::vector<Vector3d> points;
  for (int i = 0; i < kPoints; ++i)
    points.push_back(vertices[i * vertices.size() / kPoints] +
                     Vector3d(offset(random), offset(random), offset(random)));
  if (shuffled) std::shuffle(points.begin(), points.end(), random);
  return points;
}

double milliseconds(const auto& action) {
  const auto begin = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

[[maybe_unused]] double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// Both in turn, so that whatever else the machine does burdens both. Arguments: reach [um], shuffled.
void distance_against_open3d(benchmark::State& state) {
#ifdef TANKRIG_HAS_OPEN3D
  namespace o3d = open3d;
  const TriangleMesh& mesh = rippled_torus();
  const std::vector<Vector3d> points = points_near(static_cast<double>(state.range(0)) * 1e-6, state.range(1) != 0);
  const MeshDistance ours(mesh);

  std::vector<float> vertices, queries;
  std::vector<std::uint32_t> indices;
  for (const Vector3d& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(v[k]));
  for (const Vector3d& p : points)
    for (int k = 0; k < 3; ++k) queries.push_back(static_cast<float>(p[k]));
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) indices.push_back(static_cast<std::uint32_t>(t[k]));
  const auto rows = [](std::size_t count) { return o3d::core::SizeVector{static_cast<std::int64_t>(count), 3}; };
  o3d::t::geometry::RaycastingScene theirs;
  theirs.AddTriangles(o3d::core::Tensor(vertices, rows(mesh.vertices.size()), o3d::core::Float32),
                      o3d::core::Tensor(indices, rows(mesh.triangles.size()), o3d::core::UInt32));
  const o3d::core::Tensor query(queries, rows(points.size()), o3d::core::Float32);

  std::vector<double> ours_ms, theirs_ms;
  double largest_difference = 0;
  for (auto _ : state) {
    std::vector<SurfaceDistance> found;
    o3d::core::Tensor answer;
    theirs_ms.push_back(milliseconds([&] { answer = theirs.ComputeDistance(query); }));
    ours_ms.push_back(milliseconds([&] { found = ours.at(points); }));
    state.SetIterationTime(ours_ms.back() * 1e-3);
    const float* distances = answer.GetDataPtr<float>();
    for (std::size_t i = 0; i < found.size(); ++i)
      largest_difference = std::max(largest_difference, std::abs(found[i].distance - distances[i]));
  }
  state.counters["ours_ms"] = median(ours_ms);
  state.counters["open3d_ms"] = median(theirs_ms);
  state.counters["times_open3d"] = median(theirs_ms) / median(ours_ms);
  state.counters["largest_difference_m"] = largest_difference;
  if (median(theirs_ms) < median(ours_ms)) state.SkipWithError("slower than Open3D");
  if (largest_difference > 1e-6) state.SkipWithError("distances differ from Open3D's by more than 1 um");
#else
  state.SkipWithError("skipped: Open3D was not found when this was built (Debian: libopen3d-dev)");
#endif
}
BENCHMARK(distance_against_open3d)
    ->ArgNames({"reach_um", "shuffled"})
    ->ArgsProduct({{1000, 20'000}, {0, 1}})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(9);

/// 100 000 points against the tank's box, everything included but the object's preparation.
void evaluate_box_scan(benchmark::State& state) {
  const ObjectSurface object(shapes::tank_box());
  PointCloud cloud;
  shapes::append_face(cloud, shapes::kBoxLow, shapes::kBoxHigh, 2, 1, 0.00112);
  shapes::append_face(cloud, shapes::kBoxLow, shapes::kBoxHigh, 0, 1, 0.00112);
  shapes::append_face(cloud, shapes::kBoxLow, shapes::kBoxHigh, 1, 1, 0.00112);
  for (auto _ : state) benchmark::DoNotOptimize(evaluate(cloud, object, MetricThresholds{}));
  state.counters["points"] = static_cast<double>(cloud.points.size());
}
BENCHMARK(evaluate_box_scan)->Unit(benchmark::kMillisecond)->UseRealTime();

void prepare_box(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(ObjectSurface(shapes::tank_box()));
}
BENCHMARK(prepare_box)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace tankrig
