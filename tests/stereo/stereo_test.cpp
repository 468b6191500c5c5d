// Our stereo chain against walls, steps, boxes and darkness whose truth is known.
#include "reconstruction/stereo/stereo.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <opencv2/imgproc.hpp>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "reconstruction/stereo/paper_stereo.hpp"
#include "tests/stereo/errors.hpp"
#include "tests/stereo/textured_scene.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing {
namespace {

using ::testing::HasSubstr;

std::vector<StereoPair> pairs_of(const TexturedScene& scene, int count, const SensorNoise& noise) {
  std::cout << "seed " << noise.seed << "\n";
  return record(render(scene, laboratory()), laboratory(), count, noise);
}

std::size_t accounted(const StereoResult& r) {
  std::size_t pixels = r.cloud.points.size();
  for (const StereoRejection& rejection : r.rejected) pixels += rejection.pixels;
  return pixels;
}

TEST(Stereo, MeasuresAWallFromTheFront) {
  const TexturedScene scene{{wall(1.0, 0)}};
  const StereoResult r = reconstruct(pairs_of(scene, 10, {.sigma = 0.005}), laboratory());
  const CloudErrors e = errors(scene, r.cloud);
  EXPECT_GT(e.points, 44000u);
  EXPECT_LT(e.mean, 0.0003);
  EXPECT_EQ(e.outliers, 0);
  EXPECT_EQ(r.cloud.frame, "c");
  EXPECT_TRUE(r.reason.empty());
}

TEST(Stereo, MeasuresATurnedWallThroughFlatPorts) {
  StereoCalibration behind = laboratory();
  behind.left.port = FlatPort{0.050, 0.010, Vector3d(0.02, -0.01, 1).normalized()};
  behind.right.port = FlatPort{0.045, 0.010, Vector3d(-0.015, 0.02, 1).normalized()};
  const TexturedScene scene{{wall(1.0, 0.6)}};
  std::cout << "seed 1\n";
  const auto pairs = record(render(scene, behind), behind, 10, {.sigma = 0.005});
  const CloudErrors e = errors(scene, reconstruct(pairs, behind).cloud);
  EXPECT_GT(e.points, 40000u);
  EXPECT_LT(e.mean, 0.0004);
  EXPECT_LT(e.outliers, 0.0005);
}

TEST(Stereo, MeasuresAWallTurnedByFiftyDegrees) {
  const TexturedScene scene{{wall(1.0, 0.87)}};
  const CloudErrors e = errors(scene, reconstruct(pairs_of(scene, 10, {.sigma = 0.005}), laboratory()).cloud);
  EXPECT_GT(e.points, 44000u);
  EXPECT_LT(e.mean, 0.0004);
  EXPECT_LT(e.outliers, 0.0005);
}

TEST(Stereo, LaysItsWindowsAlongASteepWall) {
  const TexturedScene scene{{wall(0.9, 1.13)}};
  const CloudErrors e = errors(scene, reconstruct(pairs_of(scene, 10, {.sigma = 0.005}), laboratory()).cloud);
  EXPECT_GT(e.points, 40000u);
  EXPECT_LT(e.mean, 0.00025);
}

TEST(Stereo, MeasuresTheTanksBoxToHalfAMillimetre) {
  const TexturedScene scene = box_on_floor();
  const CloudErrors e = errors(scene, reconstruct(pairs_of(scene, 10, {.sigma = 0.005}), laboratory()).cloud);
  EXPECT_GT(e.points, 44000u);
  EXPECT_LT(e.mean, 0.0005);
  EXPECT_LT(e.outliers, 0.0005);
}

TEST(Stereo, SigmaTellsTheSizeOfTheErrors) {
  const TexturedScene scene{{wall(1.0, 0)}};
  const CloudErrors e = errors(scene, reconstruct(pairs_of(scene, 4, {.sigma = 0.03}), laboratory()).cloud);
  EXPECT_GT(e.median_sigmas, 0.45);
  EXPECT_LT(e.median_sigmas, 1.0) << "a Gaussian's is 0.67";
}

TEST(Stereo, InventsNothingBesideADepthStep) {
  const TexturedScene scene{{wall(1.15, 0), {{0, 0, 0.9}, {0.08, 0, 0}, {0, 0.06, 0}}}};
  const StereoResult r = reconstruct(pairs_of(scene, 10, {.sigma = 0.005}), laboratory());
  const CloudErrors e = errors(scene, r.cloud);
  EXPECT_GT(e.points, 42000u);
  EXPECT_LT(e.outliers, 0.0005);
  EXPECT_LT(e.mean, 0.0004);
}

TEST(Stereo, SeesNothingInDarknessAndSaysWhy) {
  TexturedScene scene = box_on_floor();
  scene.light = 0;
  const CleanPair clean = render(scene, laboratory(), 1);
  for (const double sigma : {0.0, 0.01, 0.1}) {
    const StereoResult r = reconstruct(record(clean, laboratory(), 12, {.sigma = sigma}), laboratory());
    EXPECT_EQ(r.cloud.points.size(), 0u) << "noise " << sigma;
    EXPECT_THAT(r.reason, HasSubstr("no texture above noise: "));
    EXPECT_EQ(accounted(r), r.pixels);
  }
}

TEST(Stereo, SeesNothingOnABareWall) {
  TexturedScene scene{{wall(1.0, 0.4)}};
  scene.rectangles[0].contrast = 0;
  const StereoResult r = reconstruct(pairs_of(scene, 10, {.sigma = 0.02}), laboratory());
  EXPECT_EQ(r.cloud.points.size(), 0u);
  EXPECT_THAT(r.reason, HasSubstr("no texture above noise: "));
}

TEST(Stereo, AveragesTenPercentOfNoiseAwayOverTwentyPairs) {
  const TexturedScene scene = box_on_floor();
  const StereoResult r = reconstruct(pairs_of(scene, 20, {.sigma = 0.1}), laboratory());
  const CloudErrors e = errors(scene, r.cloud);
  EXPECT_GT(e.points, 44000u);
  EXPECT_LT(e.mean, 0.0015);
  EXPECT_LT(e.outliers, 0.001);
  EXPECT_EQ(r.pairs, 20);
  EXPECT_NEAR(r.noise, 25.5, 1.5);
}

TEST(Stereo, WidensItsWindowsInADimSceneUnderTenPercentOfNoise) {
  TexturedScene scene = box_on_floor();
  scene.light = 0.3;
  const StereoResult r = reconstruct(pairs_of(scene, 20, {.sigma = 0.1}), laboratory());
  const CloudErrors e = errors(scene, r.cloud);
  EXPECT_GT(e.points, 38000u);
  EXPECT_LT(e.mean, 0.0015);
  EXPECT_LT(e.outliers, 0.001);
  EXPECT_GT(e.median_sigmas, 0.4);
  EXPECT_LT(e.median_sigmas, 1.0) << "a Gaussian's is 0.67";
}

TEST(Stereo, AveragesAllItsPairsBeforeMatching) {
  TexturedScene scene = box_on_floor();
  scene.light = 0.3;
  const std::vector<StereoPair> pairs = pairs_of(scene, 20, {.sigma = 0.1});
  const auto points = [&](std::size_t count) {
    return reconstruct({pairs.begin(), pairs.begin() + static_cast<std::ptrdiff_t>(count)}, laboratory())
        .cloud.points.size();
  };
  const std::size_t all = points(20);
  EXPECT_GT(all, 2 * points(5));
  EXPECT_GT(all, 20 * points(1));
}

TEST(Stereo, ForgetsParticlesThatDriftThroughSinglePairs) {
  const TexturedScene scene = box_on_floor();
  const std::vector<StereoPair> pairs = pairs_of(scene, 15, {.sigma = 0.005, .particles = 25});
  const CloudErrors all = errors(scene, reconstruct(pairs, laboratory()).cloud);
  const CloudErrors single = errors(scene, reconstruct_paper(pairs.front(), laboratory()).cloud);
  EXPECT_GT(single.outliers, 0.003) << "the particles are there to be seen";
  EXPECT_LT(all.outliers, 0.0005);
  EXPECT_LT(all.mean, 0.0005);
}

TEST(Stereo, DropsIslandsSmallerThanAskedFor) {
  TexturedScene scene{{wall(1.0, 0), {{0, 0, 0.999}, {0.02, 0, 0}, {0, 0.02, 0}}}};
  scene.rectangles[0].contrast = 0;
  const std::vector<StereoPair> pairs = pairs_of(scene, 6, {.sigma = 0.005});
  EXPECT_GT(reconstruct(pairs, laboratory(), {.min_region_px = 0}).cloud.points.size(), 500u);
  const StereoResult r = reconstruct(pairs, laboratory(), {.min_region_px = 10000});
  EXPECT_EQ(r.cloud.points.size(), 0u);
  EXPECT_TRUE(std::any_of(r.rejected.begin(), r.rejected.end(),
                          [](const StereoRejection& x) { return x.reason == "small island" && x.pixels > 500; }));
}

TEST(Stereo, DoesNotMindUnequalGainAndOffsetOfTheEyes) {
  const TexturedScene scene{{wall(1.0, 0.87)}};
  std::vector<StereoPair> pairs = pairs_of(scene, 10, {.sigma = 0.005});
  for (StereoPair& pair : pairs) pair.right = pair.right * 0.8 + 15;
  const CloudErrors e = errors(scene, reconstruct(pairs, laboratory()).cloud);
  EXPECT_GT(e.points, 44000u);
  EXPECT_LT(e.mean, 0.0004);
}

TEST(Stereo, TakesColourImagesAsTheirGrey) {
  const TexturedScene scene{{wall(1.0, 0.5)}};
  const std::vector<StereoPair> grey = pairs_of(scene, 1, {.sigma = 0.005});
  StereoPair colour;
  cv::cvtColor(grey[0].left, colour.left, cv::COLOR_GRAY2BGR);
  cv::cvtColor(grey[0].right, colour.right, cv::COLOR_GRAY2BGR);
  EXPECT_EQ(reconstruct({colour}, laboratory()).cloud.points.size(),
            reconstruct(grey, laboratory()).cloud.points.size());
}

TEST(Stereo, PointsKnowTheirFrameColumnAndBrightness) {
  const TexturedScene scene{{wall(1.0, 0.5)}};
  const StereoResult r = reconstruct(pairs_of(scene, 3, {.sigma = 0.005}), laboratory());
  ASSERT_FALSE(r.cloud.points.empty());
  for (const CloudPoint& point : r.cloud.points) {
    EXPECT_EQ(point.frame, 100);
    EXPECT_GT(point.sigma, 0);
    EXPECT_GE(point.intensity, 0);
    EXPECT_LE(point.intensity, 1);
    EXPECT_NEAR(point.column, laboratory().left.project(point.p)->x(), 0.01);
  }
}

TEST(Stereo, AccountsForEveryPixel) {
  const StereoResult r = reconstruct(pairs_of(box_on_floor(), 3, {.sigma = 0.01}), laboratory());
  EXPECT_EQ(r.pixels, 320u * 240u);
  EXPECT_EQ(accounted(r), r.pixels);
}

TEST(Stereo, GivesTheSameBitsOnOneThreadAndOnMany) {
  for (const double noise : {0.02, 0.15}) {  // narrow windows, and wide ones too
    const std::vector<StereoPair> pairs = pairs_of(box_on_floor(), 4, {.sigma = noise});
    const auto run = [&](std::size_t threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      cv::setNumThreads(static_cast<int>(threads));
      return reconstruct(pairs, laboratory()).cloud.points;
    };
    const std::vector<CloudPoint> one = run(1);
    const std::vector<CloudPoint> many = run(4);
    ASSERT_GT(one.size(), 1000u) << "noise " << noise;
    ASSERT_EQ(one.size(), many.size()) << "noise " << noise;
    for (std::size_t i = 0; i < one.size(); ++i) {
      ASSERT_EQ(one[i].p, many[i].p);
      ASSERT_EQ(one[i].sigma, many[i].sigma);
    }
  }
}

TEST(Stereo, RefusesWhatDoesNotFitTheCalibration) {
  EXPECT_THROW(reconstruct({}, laboratory()), InputError);
  const cv::Mat small(120, 160, CV_8U, cv::Scalar(0)), deep(240, 320, CV_16U, cv::Scalar(0)),
      good(240, 320, CV_8U, cv::Scalar(0));
  EXPECT_THROW(reconstruct({{small, good}}, laboratory()), InputError);
  EXPECT_THROW(reconstruct({{good, deep}}, laboratory()), InputError);
  EXPECT_THROW(reconstruct({{good, cv::Mat()}}, laboratory()), InputError);
  StereoCalibration swapped = laboratory();
  swapped.rMc = swapped.rMc.inverse();
  EXPECT_THROW(reconstruct({{good, good}}, swapped), InputError);
}

TEST(Stereo, ReadsItsParametersAndRefusesUnknownOnes) {
  const TemporaryFolder folder;
  const auto parameters = [&](const char* yaml) {
    return settings_from(ConfigNode::load(folder.write("stereo_parameters.yaml", yaml)), kStereoKeys);
  };
  const StereoParameters p = parameters("min_depth_m: 0.3\nwindow_radius_px: 7\n");
  EXPECT_EQ(p.min_depth_m, 0.3);
  EXPECT_EQ(p.window_radius_px, 7);
  EXPECT_EQ(p.max_depth_m, StereoParameters{}.max_depth_m);
  for (const char* bad : {"windo_radius_px: 7\n", "match_window_px: 4\n", "min_depth_m: 3\nmax_depth_m: 1\n"})
    EXPECT_THROW(parameters(bad), InputError) << bad;
}

}  // namespace
}  // namespace tankrig::testing
