// Frames a second of the simulated tank: laser on, noise on, the static light cached.
#include <benchmark/benchmark.h>

#include <chrono>

#include "tests/support/machine_witness.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim {
namespace {

const TankWorld& world() {
  static const TankWorld instance = [] {
    Scene scene = testing::full_scene();
    WorldOptions options;
    options.noise = 0.02;
    return TankWorld::from_scene(scene, options);
  }();
  return instance;
}

constexpr double kRequiredRate = 150;  // frames/s of one camera, laser and noise on, two cores
constexpr int kFrames = 300;
constexpr Duration kBearable = std::chrono::milliseconds{50};

void render(benchmark::State& state, const char* camera) {
  Exposure exposure;
  exposure.laser.fill(1);
  const auto expose = [&] {
    for (JointVector& q : exposure.q) q << 0, 0.12, 1.6 + 0.004 * static_cast<double>(exposure.index % 100), 0, 0;
    exposure.mid.ns += 40'000'000;
    ++exposure.index;
    benchmark::DoNotOptimize(world().render(camera, exposure));
  };
  expose();
  const testing_support::MachineWitness witness;
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) expose();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  state.SetItemsProcessed(state.iterations());
  if (witness.latest() > kBearable)
    state.SkipWithError(testing_support::machine_was_late(witness.latest(), kBearable).c_str());
  else if (state.iterations() / elapsed.count() < kRequiredRate)
    state.SkipWithError("slower than 150 frames/s");
}

/// First frame: the static light of one camera.
void prepare(benchmark::State& state, const char* camera) {
  const Scene scene = testing::full_scene();
  for (auto _ : state)
    benchmark::DoNotOptimize(TankWorld::from_scene(scene, {}).render(camera, testing::still(scene, 0)));
}

void external(benchmark::State& state) {
  const Scene scene = testing::full_scene();
  for (auto _ : state) benchmark::DoNotOptimize(world().render_external(scene.arm.q, true, 1000, 750));
}

BENCHMARK_CAPTURE(render, mono_720x576x3, "mono")->Iterations(kFrames)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(render, left_640x480x3, "left")->Iterations(kFrames)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(prepare, mono_720x576x3, "mono")->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(prepare, left_640x480x3, "left")->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(external)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tankrig::sim
