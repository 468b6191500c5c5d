// What the cameras' check of the beam costs a supervisor: one look at a colour picture, against one reading of its
// pixels.
#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "rig/safety/beam_check.hpp"
#include "tests/benchmarks/core_time.hpp"

namespace tankrig {
namespace {

constexpr double kRate = 25;         // pictures a second
constexpr double kMostOverMean = 4;  // times cv::mean of the same picture
constexpr int kRounds = 200;

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
  LeastCost of_mean, of_look;
  for (int i = 0; i < kRounds; ++i) {
    of_mean.take([&] { return cv::mean(lit); });
    of_look.take([&] { return look_for_stripe(lit, dark); });
  }
  const double over_mean = of_look.seconds / of_mean.seconds;
  state.counters["core_%"] = 100 * kRate * usual;
  state.counters["over_mean"] = over_mean;
  if (triples < 50) state.SkipWithError("it does not see the stripe");
  if (over_mean > kMostOverMean) state.SkipWithError("too slow beside cv::mean");
}
BENCHMARK(look)->Args({720, 576})->Args({640, 480})->Iterations(500)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace tankrig
