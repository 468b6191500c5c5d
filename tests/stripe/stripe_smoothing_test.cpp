// Sigmas of points whose errors their neighbours share, as those of a rough surface or of a lens: from runs of known truth.
#include "reconstruction/stripe/runs/stripe_smoothing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "reconstruction/stripe/runs/sigma_calibration.hpp"

namespace tankrig {
namespace {

constexpr int kColumns = 640;
constexpr double kError = 0.2;  // sd of a point [px]

/// A run along y = shape(x) with errors that fall by 1/e over `reach` columns; 0: none shares its own.
template <class Shape>
FittedRun run_along(Shape shape, double reach, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, kError);
  const double kept = reach > 0 ? std::exp(-1 / reach) : 0;
  FittedRun run(kColumns);
  double error = normal(random);
  for (int x = 0; x < kColumns; ++x) {
    run[x].peak.column = static_cast<float>(x);
    run[x].peak.position = static_cast<float>(shape(x) + error);
    run[x].peak.sigma_px = static_cast<float>(kError);
    error = kept * error + std::sqrt(1 - kept * kept) * normal(random);
  }
  return run;
}

/// Root mean square of the points' errors over their own sigmas.
template <class Shape>
double error_over_sigma(Shape shape, double reach, int smoothing = 0) {
  constexpr unsigned kSeeds = 20;
  double sum = 0;
  int points = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::vector<FittedRun> runs{run_along(shape, reach, seed)};
    const std::vector<double> correlations = calibrate_sigmas(runs);
    smooth_run(runs[0], smoothing, correlations[0]);
    for (const RunPoint& p : runs[0]) {
      sum += std::pow((p.peak.position - shape(p.peak.column)) / p.peak.sigma_px, 2);
      ++points;
    }
  }
  return std::sqrt(sum / points);
}

double line(double x) { return 100 + 0.1 * x; }
double arc(double x) { return 100 + 0.0008 * std::pow(x - kColumns / 2.0, 2); }  // of a sphere's stripe

double wave(double x) { return 100 + 72 * std::sin(x / 60); }  // bends by many sigmas over a window

TEST(StripeSmoothing, SigmasAreHonestWhereErrorsAreIndependent) {
  EXPECT_NEAR(error_over_sigma(line, 0), 1, 0.06);
  EXPECT_NEAR(error_over_sigma(arc, 0), 1, 0.06);
  EXPECT_NEAR(error_over_sigma(wave, 0), 1, 0.06);
}

TEST(StripeSmoothing, FollowsASmoothCurve) {
  double squares = 0;
  constexpr unsigned kSeeds = 10;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::vector<FittedRun> runs{run_along(wave, 0, seed)};
    const std::vector<double> correlations = calibrate_sigmas(runs);
    smooth_run(runs[0], 10, correlations[0]);
    for (const RunPoint& p : runs[0]) squares += std::pow(p.peak.position - wave(p.peak.column), 2);
  }
  EXPECT_LT(std::sqrt(squares / (kSeeds * kColumns)), 0.65 * kError) << "seeds 1 to " << kSeeds;
}

TEST(StripeSmoothing, SigmasAreNearlyHonestWhereNeighboursShareTheirErrors) {
  for (const double reach : {4.0, 8.0}) {
    const double on_line = error_over_sigma(line, reach), on_arc = error_over_sigma(arc, reach);
    RecordProperty("error_over_sigma_" + std::to_string(static_cast<int>(reach)), std::to_string(on_line));
    EXPECT_LT(on_line, 1.3) << reach << " columns";
    EXPECT_GT(on_line, 0.9) << reach << " columns";
    EXPECT_NEAR(on_arc, on_line, 0.1) << reach << " columns";
  }
}

TEST(StripeSmoothing, SmoothedSigmasAreHonestWhereErrorsAreIndependent) {
  for (const auto shape : {line, arc, wave}) {
    const double found = error_over_sigma(shape, 0, 10);
    std::printf("smoothed error over sigma: %.3f\n", found);
    EXPECT_NEAR(found, 1, 0.15);
  }
}

/// Where a quarter of the points scatters far more, as on rough parts of the surface.
TEST(StripeSmoothing, SigmasAreNotTooSmallWhereSomeScatterMore) {
  constexpr unsigned kSeeds = 20;
  constexpr int kRough = 10, kPeriod = 40;  // columns
  double squares = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::vector<FittedRun> runs{run_along(line, 0, seed)};
    for (RunPoint& p : runs[0]) {
      const double x = p.peak.column;
      if (std::fmod(x, kPeriod) < kRough)
        p.peak.position = static_cast<float>(line(x) + 5 * (p.peak.position - line(x)));
    }
    calibrate_sigmas(runs);
    for (const RunPoint& p : runs[0]) squares += std::pow((p.peak.position - line(p.peak.column)) / p.peak.sigma_px, 2);
  }
  const double found = std::sqrt(squares / (kSeeds * kColumns));
  std::printf("error over sigma where a quarter scatters five times as much: %.3f\n", found);
  EXPECT_LT(found, 1.6);  // by the median alone 1.65
}

/// As on a board's squares, or in a picture's blocks.
TEST(StripeSmoothing, SmoothedSigmasHoldWhatBlocksOfNeighboursShare) {
  constexpr int kBlock = 16;
  constexpr unsigned kSeeds = 20;
  double squares = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::vector<FittedRun> runs{run_along(line, 0, seed)};
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 0.5 * kError);
    double shared = 0;
    for (int x = 0; x < kColumns; ++x) {
      if (x % kBlock == 0) shared = normal(random);
      runs[0][x].peak.position += static_cast<float>(shared);
    }
    const std::vector<double> correlations = calibrate_sigmas(runs);
    smooth_run(runs[0], 10, correlations[0]);
    for (const RunPoint& p : runs[0]) squares += std::pow((p.peak.position - line(p.peak.column)) / p.peak.sigma_px, 2);
  }
  const double found = std::sqrt(squares / (kSeeds * kColumns));
  std::printf("smoothed error over sigma: %.3f, seeds 1 to %u\n", found, kSeeds);
  EXPECT_LT(found, 1.39);  // a parabola follows a part of it
  EXPECT_GT(found, 0.9);
}

TEST(StripeSmoothing, LeavesThePartOfASigmaThatAnEdgeHasInCommon) {
  constexpr double kOfEdge = 0.15;
  FittedRun run = run_along(line, 0, 5);
  for (int x = 300; x < 340; ++x) run[x].edge_px = kOfEdge;
  smooth_run(run, 10, 1);
  for (int x = 20; x + 20 < kColumns; ++x) {
    if (x >= 300 && x < 340)
      EXPECT_GE(run[x].peak.sigma_px, static_cast<float>(kOfEdge)) << "column " << x << ", seed 5";
    else
      EXPECT_LT(run[x].peak.sigma_px, 0.12) << "column " << x << ", seed 5";
  }
}

/// Lines are fitted four at a time where no column is missing, and alone near an end; the lines as far away as a line
/// reaches say with it how much the run bends.
TEST(StripeSmoothing, APointIsSmoothedByItsNeighboursAlone) {
  constexpr int kReach = 10, kAround = 2 * kReach;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    FittedRun run = run_along(arc, 0, seed);
    for (RunPoint& point : run) point.peak.sigma_px *= 3;  // chance makes no bend
    FittedRun whole = run;
    smooth_run(whole, kReach, 1);
    for (int x = kAround; x + kAround < kColumns; ++x) {
      FittedRun around(run.begin() + x - kAround, run.begin() + x + kAround + 1);
      smooth_run(around, kReach, 1);
      EXPECT_FLOAT_EQ(around[kAround].peak.position, whole[x].peak.position) << "column " << x << ", seed " << seed;
    }
  }
}

TEST(StripeSmoothing, FollowsACurveThatBendsLessThanOneLineCanSee) {
  constexpr unsigned kSeeds = 20;
  const auto bend = [](double x) { return 100 + 0.0018 * std::pow(x - kColumns / 2.0, 2); };
  double bias = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    FittedRun run = run_along(bend, 0, seed);
    smooth_run(run, 10, 1);
    for (int x = 60; x < kColumns - 60; ++x) bias += (run[x].peak.position - bend(x)) / (kSeeds * (kColumns - 120));
  }
  std::printf("bias %.4f px, seeds 1 to %u\n", bias, kSeeds);
  EXPECT_LT(std::abs(bias), 0.1 * kError);
}

}  // namespace
}  // namespace tankrig
