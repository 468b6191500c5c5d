// What the cameras' word on the beam costs a supervisor: one look at a colour picture, against one reading of its
// pixels.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>

#include "rig/safety/beam_check.hpp"

namespace tankrig {
namespace {

constexpr double kRate = 25;         // pictures a second
constexpr double kMostOfACore = 3;   // percent, of one camera
constexpr double kMostOverMean = 8;  // times cv::mean of the same picture
constexpr int kRounds = 50;

/// Time this thread has had a core to itself.
double core_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <class Work>
double shortest(Work work) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRounds; ++i) {
    const double begin = core_seconds();
    work();
    best = std::min(best, core_seconds() - begin);
  }
  return best;
}

/// Noise, so that nothing is guessed, with a stripe across it.
cv::Mat picture(int cols, int rows, double stripe) {
  cv::Mat image(rows, cols, CV_8UC3);
  cv::theRNG().state = 7;
  cv::randn(image, cv::Scalar::all(90), cv::Scalar::all(12));
  cv::Mat band = image.rowRange(rows / 2, rows / 2 + 5);
  band += cv::Scalar::all(stripe);
  return image;
}

void look(benchmark::State& state) {
  const int cols = static_cast<int>(state.range(0)), rows = static_cast<int>(state.range(1));
  const cv::Mat dark = picture(cols, rows, 0), lit = picture(cols, rows, 90);
  int triples = 0;
  double begin = core_seconds();
  for (auto _ : state) triples = look_for_stripe(lit, dark)->triples;
  const double usual = (core_seconds() - begin) / static_cast<double>(state.iterations());
  cv::setNumThreads(1);
  const double floor = shortest([&] { benchmark::DoNotOptimize(cv::mean(lit)); });
  const double best = shortest([&] { benchmark::DoNotOptimize(look_for_stripe(lit, dark)); });
  state.counters["core_%"] = 100 * kRate * usual;
  state.counters["over_mean"] = best / floor;
  if (triples < 50) state.SkipWithError("it does not see the stripe");
  if (state.iterations() <= 20) return;
  if (best / floor > kMostOverMean) state.SkipWithError("too slow beside cv::mean");
  if (100 * kRate * best > kMostOfACore) state.SkipWithError("takes more of a core than it may");
}
BENCHMARK(look)->Args({720, 576})->Args({640, 480})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tankrig
