// What the paper tells of its Figures 8 and 9, as far as words can be asserted, and the bounds that our methods keep: over the
// fifteen points of the coarse grid, the default rig and one seed.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using nlohmann::json;

namespace tankrig::test {
namespace {

constexpr double kLights[] = {0, 0.25, 0.5, 0.75, 1}, kNoises[] = {0, 0.05, 0.1};

const json& points() {
  static const json all = [] {
    const fs::path out = scratch_folder() / "coarse";
    const ProgramRun run =
        run_tankrig({"bench", "etc/benchmarks/paper-figures-8-9-coarse.xml", "--seed", "1", "--out", out.string()});
    if (run.exit_code != 0) throw std::runtime_error("bench failed: " + run.err);
    return json::parse(read_text(out / "results.json"))["points"];
  }();
  return all;
}

/// A detail at one point of the grid; NaN where it has no value.
double at(const char* measure, const char* detail, double light, double noise) {
  for (const json& point : points()) {
    if (point["values"][1] != noise || point["values"][2] != light) continue;
    const json& value = point["measures"][measure][detail];
    return value.is_number() ? value.get<double>() : std::nan("");
  }
  throw std::runtime_error("the grid has no such point");
}

TEST(PapersLaser, CoversAboutHalfOfTheObjectInAnyLightWithoutNoise) {
  for (const double light : kLights) EXPECT_NEAR(at("laser_paper", "coverage", light, 0), 0.45, 0.08) << light;
}

TEST(PapersLaser, HasMoreOutliersInBrightLightAndTheMoreTheNoise) {
  for (const double noise : kNoises)
    EXPECT_GT(at("laser_paper", "outliers", 1, noise), at("laser_paper", "outliers", 0, noise) + 0.01) << noise;
  EXPECT_GT(at("laser_paper", "outliers", 1, 0.05), at("laser_paper", "outliers", 1, 0) + 0.1);
  EXPECT_GT(at("laser_paper", "outliers", 1, 0.1), at("laser_paper", "outliers", 1, 0.05));
}

TEST(PapersStereo, NeedsLight) {
  for (const double noise : kNoises) EXPECT_EQ(at("stereo_paper", "coverage", 0, noise), 0) << noise;
  for (const double light : {0.5, 0.75, 1.0}) EXPECT_GT(at("stereo_paper", "coverage", light, 0), 0.4) << light;
}

TEST(PapersStereo, HasMoreOutliersWithLessLightAndWithNoise) {
  EXPECT_GT(at("stereo_paper", "outliers", 0.25, 0), at("stereo_paper", "outliers", 1, 0) + 0.02);
  EXPECT_GT(at("stereo_paper", "outliers", 1, 0.1), at("stereo_paper", "outliers", 1, 0) + 0.05);
  // Floating particles, without noise.
  for (const double light : {0.5, 0.75, 1.0}) EXPECT_GT(at("stereo_paper", "outliers", light, 0), 0.05) << light;
}

TEST(PapersStereo, IsMoreSensitiveToNoiseThanItsLaserTheMoreSoInDimLight) {
  const auto kept = [](const char* measure, double light, double noise) {
    return at(measure, "coverage", light, noise) / at(measure, "coverage", light, 0);
  };
  for (const double light : {0.25, 0.5}) {
    EXPECT_LT(kept("stereo_paper", light, 0.1), 0.1) << light;
    EXPECT_GT(kept("laser_paper", light, 0.1), 0.9) << light;
  }
  EXPECT_LT(kept("stereo_paper", 0.25, 0.05), kept("stereo_paper", 1, 0.05));
}

TEST(PapersMethods, AreAccurateToMillimetresInGoodConditions) {
  EXPECT_LT(at("laser_paper", "mean_error", 0.5, 0), 0.004);
  EXPECT_LT(at("stereo_paper", "mean_error", 0.5, 0), 0.004);
}

TEST(OurLaser, KeepsItsBoundsAtEveryPointBrightLightIncluded) {
  for (const double light : kLights)
    for (const double noise : kNoises) {
      EXPECT_GE(at("laser", "of_ceiling", light, noise), 0.95) << light << " " << noise;
      EXPECT_LE(at("laser", "outliers", light, noise), 0.01) << light << " " << noise;
      EXPECT_LE(at("laser", "mean_error", light, noise), noise <= 0.05 ? 0.0005 : 0.001) << light << " " << noise;
    }
}

TEST(OurStereo, KeepsItsBoundsInGoodLightAndUnderNoise) {
  for (const double light : {0.5, 0.75, 1.0}) {
    EXPECT_GE(at("stereo", "of_ceiling", light, 0), 0.85) << light;
    EXPECT_LE(at("stereo", "mean_error", light, 0), 0.0015) << light;
  }
  EXPECT_GE(at("stereo", "of_ceiling", 1, 0.1), 0.6);
  EXPECT_LE(at("stereo", "mean_error", 1, 0.1), 0.0015);
}

TEST(OurMethods, BeatThePapersWhereverThoseCoverAnything) {
  for (const double light : kLights)
    for (const double noise : kNoises)
      for (const auto& [ours, papers] : {std::pair{"laser", "laser_paper"}, {"stereo", "stereo_paper"}}) {
        EXPECT_GE(at(ours, "coverage", light, noise), at(papers, "coverage", light, noise)) << ours << light << noise;
        if (at(papers, "coverage", light, noise) == 0) continue;
        EXPECT_LT(at(ours, "mean_error", light, noise), at(papers, "mean_error", light, noise))
            << ours << light << noise;
        EXPECT_LT(at(ours, "outliers", light, noise), at(papers, "outliers", light, noise)) << ours << light << noise;
      }
}

}  // namespace
}  // namespace tankrig::test
