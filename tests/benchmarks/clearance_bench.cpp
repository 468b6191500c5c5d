// What the check of a whole scan costs before it moves: tank-sim's plan, its box cut into more and more triangles.
#include <benchmark/benchmark.h>

#include <chrono>

#include "core/time.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/plan/motion_check.hpp"

namespace tankrig {
namespace {

constexpr double kLongest = 2;  // [s]

/// A box about o's origin with n x n x 2 triangles a side.
Surface box_of(int n, const Vector3d& size, const Transform& bMo) {
  Surface s;
  for (const double end : {-0.5, 0.5})
    for (int axis = 0; axis < 3; ++axis) {
      const int first = static_cast<int>(s.vertices.size());
      for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
          Vector3d p;
          p[axis] = end;
          p[(axis + 1) % 3] = static_cast<double>(i) / n - 0.5;
          p[(axis + 2) % 3] = static_cast<double>(j) / n - 0.5;
          s.vertices.push_back(bMo * p.cwiseProduct(size));
        }
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const int corner = first + i * (n + 1) + j;
          s.triangles.emplace_back(corner, corner + 1, corner + n + 1);
          s.triangles.emplace_back(corner + 1, corner + n + 2, corner + n + 1);
        }
    }
  return s;
}

void check(benchmark::State& state) {
  const RigConfig rig = load_rig(TANKRIG_SOURCE_DIR "/etc/rigs/tank-sim/rig.yaml");
  Obstacles obstacles = rig.obstacles;
  for (const RigCamera& camera : rig.cameras) obstacles.cameras.push_back({camera.name, camera.housing()});
  obstacles.object = box_of(static_cast<int>(state.range(0)), {0.14, 0.30, 0.16}, rig.object.bMo);
  const ScanPlan plan = make_scan_plan(rig.scan, rig.scan.park);
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) benchmark::DoNotOptimize(check_motion(plan, rig.arm, obstacles, rig.motion_limits));
  const double each = seconds(std::chrono::steady_clock::now() - begin) / static_cast<double>(state.iterations());
  state.counters["triangles"] = static_cast<double>(obstacles.object.triangles.size());
  if (each > kLongest) state.SkipWithError("too slow");
}

BENCHMARK(check)->Arg(1)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tankrig
