// Processor time of our stereo method on as many pairs of the tank's size as a default scan records.
#include <benchmark/benchmark.h>

#include <ctime>

#include "reconstruction/stereo/stereo.hpp"
#include "tests/stereo/textured_scene.hpp"

namespace tankrig::testing {
namespace {

constexpr int kPairs = 20;
constexpr int kRuns = 3;
constexpr double kAllowed = 1.4;  ///< [s] of all cores together: what is left of 1 s on two of them to open the session

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Every pixel of the scene has texture: more work than the tank, whose floor has next to none.
void reconstruct_pairs(benchmark::State& state) {
  const StereoCalibration calibration = laboratory_pair(640, 480);
  const std::vector<StereoPair> pairs =
      record(render(box_on_floor(), calibration, 1), calibration, kPairs, {.sigma = 0.005});
  const double begin = processor_seconds();
  for (auto _ : state) benchmark::DoNotOptimize(reconstruct(pairs, calibration));
  if ((processor_seconds() - begin) / kRuns > kAllowed) state.SkipWithError("more than 1.4 s of processor time");
}

BENCHMARK(reconstruct_pairs)->Iterations(kRuns)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tankrig::testing
