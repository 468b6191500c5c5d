// The paper's block matching at its defaults.
#include "reconstruction/stereo/paper_stereo.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iostream>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "tests/stereo/errors.hpp"
#include "tests/stereo/textured_scene.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing {
namespace {

StereoPair pair_of(const TexturedScene& scene, const SensorNoise& noise) {
  std::cout << "seed " << noise.seed << "\n";
  return record(render(scene, laboratory()), laboratory(), 1, noise).front();
}

TEST(PaperStereo, FindsTheBoxWithinTwoMillimetres) {
  const TexturedScene scene = box_on_floor();
  const StereoResult r = reconstruct_paper(pair_of(scene, {.sigma = 0.005}), laboratory());
  const CloudErrors e = errors(scene, r.cloud);
  EXPECT_GT(e.points, 35000u);
  EXPECT_LT(e.mean, 0.002);
  EXPECT_EQ(r.pairs, 1);
  EXPECT_EQ(r.cloud.frame, "c");
  EXPECT_EQ(r.cloud.points.size() + r.rejected.at(0).pixels, r.pixels);
}

TEST(PaperStereo, LosesPointsToNoise) {
  const TexturedScene scene = box_on_floor();
  const CloudErrors quiet = errors(scene, reconstruct_paper(pair_of(scene, {}), laboratory()).cloud);
  const CloudErrors noisy = errors(scene, reconstruct_paper(pair_of(scene, {.sigma = 0.1}), laboratory()).cloud);
  EXPECT_LT(static_cast<double>(noisy.points), 0.7 * static_cast<double>(quiet.points));
  EXPECT_GT(noisy.mean, 1.5 * quiet.mean);
}

TEST(PaperStereo, TakesParticlesForPointsOfTheScene) {
  const TexturedScene scene = box_on_floor();
  const CloudErrors clear = errors(scene, reconstruct_paper(pair_of(scene, {}), laboratory()).cloud);
  const CloudErrors snow = errors(scene, reconstruct_paper(pair_of(scene, {.particles = 25}), laboratory()).cloud);
  EXPECT_LT(clear.outliers, 0.001);
  EXPECT_GT(snow.outliers, 0.003);
}

TEST(PaperStereo, FindsNothingInDarkness) {
  TexturedScene scene = box_on_floor();
  scene.light = 0;
  const StereoResult r = reconstruct_paper(pair_of(scene, {}), laboratory());
  EXPECT_TRUE(r.cloud.points.empty());
  EXPECT_FALSE(r.reason.empty());
}

TEST(PaperStereo, CannotSeeNearerThanItsDisparityRange) {
  const TexturedScene scene{{wall(1.0, 0)}};
  const StereoPair pair = pair_of(scene, {.sigma = 0.005});
  const double disparity_px = 775.0 * 0.0883;
  ASSERT_GT(disparity_px, 64);
  std::size_t on_the_wall = 0;
  for (const CloudPoint& p : reconstruct_paper(pair, laboratory(), {.disparity_range = 64}).cloud.points)
    on_the_wall += scene.distance(p.p) < 0.010;
  EXPECT_LT(on_the_wall, 400u);
}

TEST(PaperStereo, ReadsItsParametersAndRefusesUnknownOnes) {
  const TemporaryFolder folder;
  const auto parameters = [&](const char* yaml) {
    return settings_from(ConfigNode::load(folder.write("paper_stereo_parameters.yaml", yaml)), kPaperStereoKeys);
  };
  const PaperStereoParameters p = parameters("disparity_range: 96\n");
  EXPECT_EQ(p.disparity_range, 96);
  EXPECT_EQ(p.correlation_window_size, 15);
  for (const char* bad : {"disparity_range: 100\n", "prefilter_size: 8\n", "disparity: 64\n"})
    EXPECT_THROW(parameters(bad), InputError) << bad;
}

}  // namespace
}  // namespace tankrig::testing
