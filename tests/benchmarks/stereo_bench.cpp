// Processor time of our stereo method on as many pairs of the tank's size as a default scan records, beside OpenCV's
// semi-global matcher on the same pairs.
#include <benchmark/benchmark.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <ctime>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "reconstruction/stereo/stereo.hpp"
#include "tests/stereo/textured_scene.hpp"

namespace tankrig::testing {
namespace {

constexpr int kPairs = 20;
constexpr int kRuns = 3;
constexpr int kDisparities = 128, kBlock = 5;  // of the peer
constexpr double kMostOfPeers = 1;             // matching alone, of pairs as they are

/// Of all cores together, at least over the runs: what others do only adds.
struct LeastProcessorTime {
  double seconds = std::numeric_limits<double>::infinity();

  template <class Work>
  void take(Work work) {
    const double begin = now();
    work();
    seconds = std::min(seconds, now() - begin);
  }

 private:
  static double now() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
};

/// Every pixel of the scene has texture: more work than the tank, whose floor has next to none.
void reconstruct_pairs(benchmark::State& state) {
  const StereoCalibration calibration = laboratory_pair(640, 480);
  const std::vector<StereoPair> pairs =
      record(render(box_on_floor(), calibration, 1), calibration, kPairs, {.sigma = 0.005});
  const auto match = [&](std::size_t pair) {
    const auto peer = cv::StereoSGBM::create(0, kDisparities, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock);
    cv::Mat disparity;
    peer->compute(pairs[pair].left, pairs[pair].right, disparity);
  };
  LeastProcessorTime ours, peers;
  for (auto _ : state) {
    ours.take([&] { benchmark::DoNotOptimize(reconstruct(pairs, calibration)); });
    peers.take([&] { tbb::parallel_for(std::size_t{0}, pairs.size(), match); });  // on all cores, as ours
  }
  state.counters["ours_s"] = ours.seconds;
  state.counters["of_peers"] = ours.seconds / peers.seconds;
  if (ours.seconds > kMostOfPeers * peers.seconds) state.SkipWithError("slower than OpenCV's matcher");
}

BENCHMARK(reconstruct_pairs)->Iterations(kRuns)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tankrig::testing
