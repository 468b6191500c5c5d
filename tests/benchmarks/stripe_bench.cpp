// What the stripe detectors cost on one core, in ns per pixel of a colour image: ours with a dark image and the
// paper's, beside the paper's chain made of OpenCV's parts and one reading of the image, in the same run.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/benchmarks/core_time.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

// Times the paper's chain of OpenCV's parts in the same run. Measured, alone on the machine: 0.29 to 0.51, 0.04.
constexpr double kMostOfOurs = 0.8, kMostOfPapers = 0.2;
constexpr int kRounds = 40;

/// No method is charged for fresh pages: what is freed is kept.
void keep_memory() {
  constexpr int kEnough = 32 << 20;  // glibc takes no more
  ::mallopt(M_MMAP_THRESHOLD, kEnough);
  ::mallopt(M_TRIM_THRESHOLD, -1);
}

/// A stripe on a box and on the floor beside it, in a lit tank.
GeneratedStripe scene(int width, int height) {
  GeneratedStripe g;
  g.width = width, g.height = height;
  g.sd = 1.6;
  g.noise = 2;
  g.peak = 150;
  g.row = [=](int x) {
    const bool box = x > 0.3 * width && x < 0.7 * width;
    return (box ? 0.35 : 0.55) * height + 0.03 * height * x / width;
  };
  g.scene = [=](int x, int y) { return 30.0 + 25.0 * y / height + ((x / 40 + y / 40) % 2 ? 6 : 0); };
  return g;
}

std::uint64_t read_once(const cv::Mat& image) {
  std::uint64_t sum = 0;
  const std::size_t words = image.total() * image.elemSize() / sizeof(std::uint64_t);
  const std::uint8_t* bytes = image.data;
  for (std::size_t i = 0; i < words; ++i, bytes += sizeof(std::uint64_t)) {
    std::uint64_t word;
    std::memcpy(&word, bytes, sizeof word);
    sum += word;
  }
  return sum;
}

/// HSV, gate, the column's brightest pixel, the centre of masses around it.
std::vector<double> chain_of_opencv(const cv::Mat& image, const PaperStripeParameters& p) {
  cv::Mat hsv, mask, sum, gated, top;
  cv::cvtColor(image, hsv, cv::COLOR_BGR2HSV);
  cv::inRange(hsv, cv::Scalar(p.hue_min, p.saturation_min, p.value_min),
              cv::Scalar(p.hue_max, p.saturation_max, p.value_max), mask);
  cv::transform(image, sum, cv::Matx13f(1.0f / 3, 1.0f / 3, 1.0f / 3));
  sum.copyTo(gated, mask);
  cv::reduce(gated, top, 0, cv::REDUCE_MAX);
  std::vector<int> brightest(static_cast<std::size_t>(image.cols), -1);
  for (int y = 0; y < gated.rows; ++y)
    for (int x = 0; x < gated.cols; ++x)
      if (const auto value = gated.ptr(y)[x]; value > 0 && value == top.ptr()[x] && brightest[x] < 0) brightest[x] = y;
  std::vector<double> rows;
  for (int x = 0; x < image.cols; ++x) {
    if (brightest[x] < 0) continue;
    const cv::Range around(std::max(0, brightest[x] - p.half_window),
                           std::min(image.rows, brightest[x] + p.half_window + 1));
    const cv::Moments m = cv::moments(sum(around, cv::Range(x, x + 1)));
    rows.push_back(around.start + m.m01 / m.m00);
  }
  return rows;
}

void detect(benchmark::State& state) {
  cv::setNumThreads(1);
  keep_memory();
  const int width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  GeneratedStripe g = scene(width, height);
  const cv::Mat image = g.image();
  g.laser = false, g.seed = 2;
  const cv::Mat dark = g.image();
  const StripeParameters ours;
  StripeLook look = find_look(image, dark, StripeOrientation::kColumns);
  look.contrast = measure_contrasts(image, dark, ours, look).best();
  PaperStripeParameters papers = PaperStripeParameters::simulation();
  papers.orientation = StripeOrientation::kColumns;
  const auto detect_ours = [&] { return detect_stripe(image, dark, ours, look).peaks.size(); };
  const auto detect_papers = [&] { return detect_paper(image, papers).peaks.size(); };

  LeastCost of_ours, of_papers, of_opencv, of_reading;
  for (int round = 0; round < kRounds; ++round) {
    of_reading.take([&] { return read_once(image); });
    of_opencv.take([&] { return chain_of_opencv(image, papers); });
    of_papers.take(detect_papers);
    of_ours.take(detect_ours);
  }
  for (auto _ : state) benchmark::DoNotOptimize(detect_ours());
  const double pixels = static_cast<double>(image.total());
  state.counters["ours_ns"] = 1e9 * of_ours.seconds / pixels;
  state.counters["paper_ns"] = 1e9 * of_papers.seconds / pixels;
  state.counters["opencv_ns"] = 1e9 * of_opencv.seconds / pixels;
  state.counters["read_ns"] = 1e9 * of_reading.seconds / pixels;
  const auto columns = static_cast<std::size_t>(width);
  if (detect_ours() < columns * 9 / 10) state.SkipWithError("ours does not find the stripe");
  if (detect_papers() < columns * 9 / 10) state.SkipWithError("the paper's does not find the stripe");
  if (chain_of_opencv(image, papers).size() != detect_papers())
    state.SkipWithError("OpenCV's chain finds another stripe");
  if (of_ours.seconds > kMostOfOurs * of_opencv.seconds) state.SkipWithError("ours is too slow beside OpenCV's chain");
  if (of_papers.seconds > kMostOfPapers * of_opencv.seconds)
    state.SkipWithError("the paper's is too slow beside OpenCV's chain");
}
BENCHMARK(detect)
    ->Args({640, 480})
    ->Args({720, 576})
    ->Args({1920, 1080})
    ->Iterations(20)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tankrig
