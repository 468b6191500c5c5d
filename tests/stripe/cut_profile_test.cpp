// Stripes across the edges of a board's squares: the brightest light is on the bright side, the stripe's middle may not be.
#include "reconstruction/stripe/fit/cut_profile.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <random>
#include <sstream>

#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

constexpr int kSquare = 45;
constexpr double kBlack = 0.1;

bool is_white(int x, int y) { return (x / kSquare + y / kSquare) % 2 == 0; }

/// A red stripe that meets the edge between two rows of squares at about column 200.
GeneratedStripe on_board(double peak, unsigned seed) {
  GeneratedStripe g;
  g.width = 400, g.height = 300;
  g.peak = peak;
  g.sd = 2;
  g.bgr = {0.30, 0.26, 1.0};
  g.noise = 2;
  g.seed = seed;
  g.row = [](int x) { return 4 * kSquare + 0.11 * (x - 200); };
  g.scene = [](int x, int y) { return is_white(x, y) ? 98.0 : 17.0; };
  g.reflectance = [](int x, int y) { return is_white(x, y) ? 1.0 : kBlack; };
  return g;
}

struct OnBoard {
  double found = 0, gross = 0;  ///< shares of the columns; gross: off by 3 px and more
  double rms = 0, over_sigma = 0;
};

OnBoard judged(const StripeDetection& detection, const GeneratedStripe& truth) {
  OnBoard out;
  double squares = 0, normalised = 0;
  int near = 0;
  for (const StripePeak& peak : detection.peaks) {
    const double error = peak.position - truth.true_row(static_cast<int>(peak.column));
    if (!(std::abs(error) < 3)) {
      out.gross += 1.0 / truth.width;
      continue;
    }
    ++near;
    squares += error * error;
    normalised += std::pow(error / peak.sigma_px, 2);
  }
  out.found = static_cast<double>(near) / truth.width;
  out.rms = std::sqrt(squares / near);
  out.over_sigma = std::sqrt(normalised / near);
  return out;
}

/// Of a stripe with that peak [DN], not smoothed, without a dark image; in a colour image, or in its red channel alone.
OnBoard detected(double peak, bool grey, unsigned seed) {
  StripeParameters parameters;
  parameters.smoothing_px = 0;
  const GeneratedStripe truth = on_board(peak, seed);
  cv::Mat image = truth.image();
  if (grey) cv::extractChannel(image, image, 2);
  const OnBoard result = judged(detect_stripe(image, {}, parameters), truth);
  std::cout << "seed " << seed << ": found " << result.found << ", gross " << result.gross << ", rms " << result.rms
            << " px, error over sigma " << result.over_sigma << '\n';
  return result;
}

TEST(CutProfile, OfAStripeThatClipsOnTheWhiteSquaresIsFoundAcrossTheirEdges) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const OnBoard result = detected(900, false, seed);
    EXPECT_GT(result.found, 0.98);
    EXPECT_LT(result.gross, 0.003);
    EXPECT_LT(result.rms, 0.25);
    EXPECT_LT(result.over_sigma, 1.8);
  }
}

/// Whose black is 0.17 of its white to the room, and 0.1 to the laser; edges as soft as a lens shows them.
GeneratedStripe on_soft_board(double edge_sd, unsigned seed) {
  GeneratedStripe g = on_board(140, seed);
  g.bgr = {0.1, 1.0, 0.04};
  g.row = [slope = 0.05 + 0.03 * seed](int x) { return 4 * kSquare + slope * (x - 200); };
  const auto white = [edge_sd](int x, int y) {
    const auto edge = [&](double t) { return std::erf(t / (std::sqrt(2.0) * std::max(edge_sd, 0.01))); };
    const auto wave = [&](double at) {
      const double t = std::fmod(at, 2 * kSquare);
      return edge(t) - edge(t - kSquare) + edge(t - 2 * kSquare);
    };
    return 0.5 * (1 + wave(x) * wave(y));
  };
  g.scene = [white](int x, int y) { return 17 + 81 * white(x, y); };
  g.reflectance = [white](int x, int y) { return kBlack + (1 - kBlack) * white(x, y); };
  return g;
}

TEST(CutProfile, OnABoardHasItsSigmaWhetherEdgesAreSharpOrSoft) {
  constexpr int kImages = 6;
  for (const double edge_sd : {0.0, 0.5, 1.0})
    for (const bool with_dark : {false, true})
      for (const int smoothing_px : {0, 10}) {
        double found = 0, gross = 0, squares = 0, normalised = 0;
        for (unsigned seed = 1; seed <= kImages; ++seed) {
          const GeneratedStripe lit = on_soft_board(edge_sd, seed);
          GeneratedStripe unlit = on_soft_board(edge_sd, seed + 100);
          unlit.laser = false;
          StripeParameters parameters;
          parameters.smoothing_px = smoothing_px;
          const cv::Mat dark = with_dark ? unlit.image() : cv::Mat();
          const OnBoard one = judged(detect_stripe(lit.image(), dark, parameters), lit);
          found += one.found / kImages, gross += one.gross / kImages;
          squares += one.rms * one.rms / kImages, normalised += one.over_sigma * one.over_sigma / kImages;
        }
        const double rms = std::sqrt(squares), over_sigma = std::sqrt(normalised);
        std::ostringstream where;
        where << "seeds 1 to " << kImages << ", edges' sd " << edge_sd << " px, " << (with_dark ? "" : "no ")
              << "dark image, smoothed over " << smoothing_px << " px";
        SCOPED_TRACE(where.str());
        std::cout << where.str() << ": found " << found << ", rms " << rms << " px, error over sigma " << over_sigma
                  << '\n';
        EXPECT_GT(found, 0.99);
        EXPECT_EQ(gross, 0);
        EXPECT_LT(rms, smoothing_px == 0 ? 0.31 : edge_sd < 1 ? 0.09 : 0.2);
        EXPECT_GT(over_sigma, smoothing_px == 0 ? 0.85 : 0.6);
        EXPECT_LT(over_sigma, 1.1);
      }
}

TEST(CutProfile, InAGreyImageIsFoundAcrossTheEdgesThatNothingElseShows) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const OnBoard result = detected(140, true, seed);
    EXPECT_GT(result.found, 0.9);
    EXPECT_LT(result.gross, 0.005);
    EXPECT_LT(result.rms, 0.25);
    EXPECT_LT(result.over_sigma, 1.2);
  }
}

struct Section {
  std::vector<float> values, reflectance;
};

/// A Gauss of sd 2 px at `centre` on a surface that is dark below row 12.
Section section_at(double centre, double noise, std::mt19937& random) {
  constexpr int kRows = 25, kEdgeRow = 12;
  std::normal_distribution<double> normal;
  Section section;
  for (int i = 0; i < kRows; ++i) {
    const double share = i == kEdgeRow ? 0.5 * (1 + kBlack) : i < kEdgeRow ? 1 : kBlack;
    const double t = (i - centre) / 2;
    section.reflectance.push_back(static_cast<float>(share));
    section.values.push_back(static_cast<float>(share * (90 + 400 * std::exp(-0.5 * t * t)) + noise * normal(random)));
  }
  return section;
}

TEST(CutProfile, IsCentredOnBothSidesOfTheEdgeFromWhereItIsBrightest) {
  std::mt19937 random(7);
  const ProfileFitter fitter(2, true);
  for (double centre = 8; centre <= 16; centre += 0.5) {
    SCOPED_TRACE(testing::Message() << "seed 7, centre " << centre);
    const Section s = section_at(centre, 1, random);
    const double start = std::min(centre, 11.0);
    const ProfileSection section{s.values.data(), static_cast<int>(s.values.size()), start, s.reflectance.data()};
    const ProfileFit fit = fit_cut(fitter, section, {1, 0}, kStartsInTheDark);
    ASSERT_TRUE(fit.ok);
    EXPECT_NEAR(fit.position, centre, 0.5);
    EXPECT_NEAR(fit.position, centre, 4 * fit.sigma);
    EXPECT_LT(fit.sigma, 1.5);
  }
}

TEST(CutProfile, IsTakenForCutOnlyWhereThatExplainsMore) {
  std::mt19937 random(8);
  const ProfileFitter fitter(2, true);
  const Section cut = section_at(14, 1, random);
  const auto seen = fit_unseen_edge(fitter, cut.values, 11, {1, 0}, 0);
  ASSERT_TRUE(seen && seen->ok) << "seed 8";
  EXPECT_NEAR(seen->position, 14, 5 * seen->sigma);
  const ProfileFit whole = fitter.fit({cut.values.data(), static_cast<int>(cut.values.size()), 11.0}, {1, 0});
  EXPECT_TRUE(!whole.ok || std::abs(whole.position - 14) > 1) << "a Gauss alone is drawn to the bright side";

  Section plain = section_at(12, 1, random);
  for (std::size_t i = 0; i < plain.values.size(); ++i) plain.values[i] /= plain.reflectance[i];
  EXPECT_FALSE(fit_unseen_edge(fitter, plain.values, 12, {1, 0}, 0)) << "its ends are alike";
}

TEST(CutProfile, SigmaHoldsTheOtherModelAsFarAsChanceDoesNotTellThemApart) {
  ProfileFit whole{.ok = true, .position = 10, .sigma = 0.1, .misfit = 1, .freedom = 11};
  ProfileFit cut{.ok = true, .position = 11, .sigma = 0.1, .misfit = 1, .freedom = 11};
  EXPECT_EQ(likelier(whole, cut).position, 10) << "an edge has to explain something";
  EXPECT_NEAR(likelier(whole, cut).sigma, std::sqrt(0.01 + 0.1), 1e-6);
  whole.misfit = 1.5;
  EXPECT_EQ(likelier(whole, cut).position, 11);
  EXPECT_GT(likelier(whole, cut).sigma, 0.5);
  whole.misfit = 5;
  EXPECT_EQ(likelier(whole, cut).position, 11);
  EXPECT_NEAR(likelier(whole, cut).sigma, 0.1, 0.01);
  cut.ok = false;
  EXPECT_EQ(likelier(whole, cut).position, 10);
  EXPECT_EQ(likelier(whole, cut).sigma, 0.1);
  whole.ok = false;
  EXPECT_FALSE(likelier(whole, cut).ok);
  cut.ok = true;
  EXPECT_EQ(likelier(whole, cut).position, 11);
}

TEST(CutProfile, TheVeilIsWhatDarkPartsShowBesideTheirReflectanceToTheLaser) {
  std::vector<SurfaceLight> samples;
  for (int i = 0; i < 20; ++i) samples.push_back({100.0 + 0.1 * i, 150}), samples.push_back({20, 15});
  // 0.1 of the laser's light, so 8 of 100 more than dark parts reflect of the scene's.
  const double veil = veil_of(samples, 2);
  EXPECT_NEAR((20 - veil * 101) / (101 - veil * 101), 0.1, 1e-3);
  EXPECT_NEAR(veil, 0.11, 0.01);
  for (SurfaceLight& sample : samples) sample.laser = 1.5 * sample.scene;
  EXPECT_NEAR(veil_of(samples, 2), 0, 1e-9) << "the scene tells the truth";
  EXPECT_EQ(veil_of(samples, 20), 0) << "its edges are in the noise";
  for (SurfaceLight& sample : samples) sample.laser = 100;
  EXPECT_EQ(veil_of(samples, 2), 0) << "nothing is dark to the laser: it meets another surface, or glows";
  samples.resize(14);
  for (SurfaceLight& sample : samples) sample.laser = sample.scene > 50 ? 150 : 15;
  EXPECT_EQ(veil_of(samples, 2), 0) << "seven of either";
  EXPECT_EQ(veil_of({}, 2), 0);
}

TEST(CutProfile, ReflectanceIsToldByTheLightThatIsNotTheLasers) {
  const GeneratedStripe truth = on_board(100, 3);
  StripeAppearance appearance;
  const Eigen::Vector3f colour = truth.bgr.normalized().cast<float>();
  appearance.light = {colour[0], colour[1], colour[2]};
  appearance.noise = truth.noise;
  std::vector<float> reflectance;
  const cv::Mat image = truth.image();
  // The edge at row 180 is the fifteenth of these.
  EXPECT_TRUE(measure_reflectance(image, {}, appearance, {100, 165, 30, {}}, 0, reflectance));
  ASSERT_EQ(reflectance.size(), 30u);
  const bool white_above = is_white(100, 165);
  for (int i = 0; i < 30; ++i)
    if (i < 13 || i > 16) {
      const double expected = (i < 15) == white_above ? 1 : 17.0 / 98;
      EXPECT_NEAR(reflectance[i], expected, 0.15) << "row " << 165 + i;
    }
  EXPECT_FALSE(measure_reflectance(image, {}, appearance, {100, 140, 30, {}}, 0, reflectance)) << "one square";
  cv::Mat grey;
  cv::extractChannel(image, grey, 2);
  EXPECT_FALSE(measure_reflectance(grey, {}, appearance, {100, 165, 30, {}}, 0, reflectance)) << "grey, no dark image";
  GeneratedStripe unlit = truth;
  unlit.laser = false;
  cv::Mat dark;
  cv::extractChannel(unlit.image(), dark, 2);
  appearance.light = {1, 0, 0};
  EXPECT_TRUE(measure_reflectance(grey, dark, appearance, {100, 165, 30, {}}, 0, reflectance));
}

}  // namespace
}  // namespace tankrig
