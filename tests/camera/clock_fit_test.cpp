#include "drivers/camera/clock_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tankrig {
namespace {

using Verdict = ClockFit::Verdict;
using std::chrono::microseconds;
using std::chrono::milliseconds;

/// A device whose clock began at `start_ns` when ours was 1000 s, and runs fast by `ppm`.
struct Device {
  std::int64_t start_ns = 7'000'000'000'000'000;
  double ppm = 0;
  static constexpr std::int64_t kEpoch = 1'000'000'000'000;

  std::int64_t at(Stamp host) const {
    const auto elapsed = static_cast<long double>(host.ns - kEpoch);
    return start_ns + static_cast<std::int64_t>(std::llround(elapsed * (1 + ppm * 1e-6L)));
  }
};

Stamp host_at(double s) { return Stamp{Device::kEpoch} + from_seconds(s); }

/// A latch reading: the truth lies anywhere in a bracket of the given width.
ClockSample bracketed(const Device& device, Stamp truth, double width_us, std::mt19937& random) {
  const double offset = std::uniform_real_distribution<double>(-0.5, 0.5)(random) * width_us;
  return {device.at(truth), truth + from_seconds(offset * 1e-6), from_seconds(width_us * 1e-6 / std::sqrt(12.0))};
}

TEST(ClockFit, MapsNothingBeforeItsFirstSample) { EXPECT_FALSE(ClockFit{}.map(5).has_value()); }

TEST(ClockFit, MapsFromOneSampleAndSaysHowSoonThatAges) {
  ClockFit sut;
  sut.add({1'000'000, Stamp{50}, microseconds(100)});
  const MappedStamp at = *sut.map(1'000'000);
  EXPECT_EQ(at.stamp, Stamp{50});
  EXPECT_NEAR(seconds(at.sigma), 100e-6, 1e-6);
  const MappedStamp later = *sut.map(1'000'000 + 10'000'000'000);
  EXPECT_EQ(later.stamp, (Stamp{50} + from_seconds(10)));
  EXPECT_GT(later.sigma, microseconds(900)) << "100 ppm for 10 s";
  EXPECT_LT(later.sigma, microseconds(1200));
}

TEST(ClockFit, IsExactOnAnExactClockHoweverLargeItsCounter) {
  Device device{0x0FFF'0000'0000'0000, 83.25};
  ClockFit sut;
  for (int i = 0; i < 40; ++i) sut.add({device.at(host_at(i)), host_at(i), microseconds(1)});
  EXPECT_NEAR(sut.drift_ppm(), 83.25, 0.01);
  EXPECT_NEAR(static_cast<double>((sut.map(device.at(host_at(40.5)))->stamp - host_at(40.5)).count()), 0, 100);
}

TEST(ClockFit, FindsDriftWithAnHonestSigma) {
  // Normalised errors over many devices have unit variance, at the ages a frame's stamp has.
  double sum2 = 0, worst = 0;
  int n = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    std::mt19937 random(seed);
    Device device;
    device.ppm = std::normal_distribution<double>(0, 60)(random);
    const int samples = 1 + static_cast<int>(random() % 60);
    ClockFit sut;
    for (int i = 0; i < samples; ++i)
      sut.add(bracketed(device, host_at(i), std::uniform_real_distribution<double>(80, 800)(random), random));
    EXPECT_EQ(sut.outliers(), 0u) << "seed " << seed;
    const Stamp truth = host_at(samples - 1 + std::uniform_real_distribution<double>(0, 1)(random));
    const MappedStamp mapped = *sut.map(device.at(truth));
    const double z = static_cast<double>((mapped.stamp - truth).count()) / static_cast<double>(mapped.sigma.count());
    sum2 += z * z;
    worst = std::max(worst, std::abs(z));
    ++n;
  }
  const double rms = std::sqrt(sum2 / n);
  EXPECT_GT(rms, 0.7);
  EXPECT_LT(rms, 1.3);
  EXPECT_LT(worst, 5);
}

TEST(ClockFit, GrowsSurerWithItsSamples) {
  std::mt19937 random(5);
  Device device{1, -45};
  ClockFit sut;
  sut.add(bracketed(device, host_at(0), 400, random));
  const Duration first = sut.map(device.at(host_at(0)))->sigma;
  for (int i = 1; i < 60; ++i) sut.add(bracketed(device, host_at(i), 400, random));
  EXPECT_LT(sut.map(device.at(host_at(59)))->sigma * 2, first);
  EXPECT_NEAR(sut.drift_ppm(), -45, 5 * sut.drift_sigma_ppm());
  EXPECT_LT(sut.drift_sigma_ppm(), 2);
}

TEST(ClockFit, SetsAsideReadingsThatAreFarOff) {
  std::mt19937 random(6);
  Device device{1, 20};
  ClockFit sut;
  for (int i = 0; i < 30; ++i) {
    sut.add(bracketed(device, host_at(i), 200, random));
    if (i % 7 == 6) {
      ClockSample late = bracketed(device, host_at(i + 0.5), 200, random);
      late.host = late.host + milliseconds(20 + i);
      EXPECT_EQ(sut.add(late), Verdict::kOutlier);
    }
  }
  EXPECT_EQ(sut.outliers(), 4u);
  EXPECT_EQ(sut.jumps(), 0u);
  EXPECT_LT(std::abs(seconds(sut.map(device.at(host_at(30)))->stamp - host_at(30))), 100e-6);
}

TEST(ClockFit, BeginsAnewWhenTheClockIsSet) {
  for (const double step_s : {-5000.0, -0.010, 0.010, 3600.0}) {
    SCOPED_TRACE(step_s);
    std::mt19937 random(7);
    Device device{10'000'000'000'000, 35};
    ClockFit sut;
    for (int i = 0; i < 20; ++i) sut.add(bracketed(device, host_at(i), 200, random));
    device.start_ns += from_seconds(step_s).count();
    EXPECT_EQ(sut.add(bracketed(device, host_at(20), 200, random)), Verdict::kOutlier);
    EXPECT_EQ(sut.add(bracketed(device, host_at(21), 200, random)), Verdict::kJump);
    const MappedStamp mapped = *sut.map(device.at(host_at(21)));
    EXPECT_LT(std::abs(seconds(mapped.stamp - host_at(21))), 300e-6);
    EXPECT_EQ(sut.jumps(), 1u);
    EXPECT_EQ(sut.outliers(), 0u) << "it was no outlier after all";
  }
}

TEST(ClockFit, ForgetsWhatIsOlderThanItsWindow) {
  ClockFitSettings settings;
  settings.window = 10;
  ClockFit sut(settings);
  Device device{1, 10};
  for (int i = 0; i < 50; ++i) sut.add({device.at(host_at(i)), host_at(i), microseconds(10)});
  EXPECT_EQ(sut.samples(), 10u);
  sut.add({device.at(host_at(1000)), host_at(1000), microseconds(10)});
  EXPECT_EQ(sut.samples(), 1u) << "older than the span";
}

TEST(ArrivalEnvelope, IsTheFloorOfOneSidedDelays) {
  // Delays: 300 us that all have, and exponential waiting of 1 ms mean. The floor is known to the driver.
  double sum2 = 0, error_sum = 0;
  int n = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    std::exponential_distribution<double> wait(1 / 1e-3);
    Device device{5, std::normal_distribution<double>(0, 50)(random)};
    ArrivalEnvelope envelope;
    ClockFit sut;
    const int frames = 50 + static_cast<int>(random() % 1500);
    for (int i = 0; i < frames; ++i) {
      const Stamp truth = host_at(i * 0.04);
      if (const auto sample = envelope.add(device.at(truth), truth + from_seconds(wait(random)))) sut.add(*sample);
    }
    const Stamp truth = host_at(frames * 0.04);
    const MappedStamp mapped = *sut.map(device.at(truth));
    const double error = static_cast<double>((mapped.stamp - truth).count());
    error_sum += error;
    sum2 += std::pow(error / static_cast<double>(mapped.sigma.count()), 2);
    ++n;
  }
  const double rms = std::sqrt(sum2 / n);
  EXPECT_GT(rms, 0.5);
  EXPECT_LT(rms, 1.5);
  EXPECT_LT(std::abs(error_sum / n), 20e3) << "no bias beyond 20 us [ns]";
}

TEST(ArrivalEnvelope, BeginsAnewWhenTheDeviceStampGoesBack) {
  ArrivalEnvelope sut(4);
  EXPECT_FALSE(sut.add(1000, Stamp{1}));
  EXPECT_FALSE(sut.add(2000, Stamp{1001}));
  EXPECT_FALSE(sut.add(10, Stamp{2001}));
  EXPECT_FALSE(sut.add(1010, Stamp{3001}));
  EXPECT_FALSE(sut.add(2010, Stamp{4001}));
  const auto sample = sut.add(3010, Stamp{5001});
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->host.ns - sample->device_ns, 1991);
}

}  // namespace
}  // namespace tankrig
