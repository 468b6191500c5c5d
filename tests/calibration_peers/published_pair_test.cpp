// `tankrig calibrate` on the chessboard pictures that Debian's opencv-doc ships, beside the figures published for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calibration_peers/public_pictures.hpp"
#include "tests/program/program.hpp"

namespace tankrig {
namespace {

TEST(PublishedPair, IsFoundAsPublished) {
  if (!public_pictures_here()) GTEST_SKIP() << kNoPublicPictures;
  const test::ProgramRun run = test::run_tankrig(
      {"calibrate", "stereo", "--data", kPublicPictures, "--pattern", "9x6", "--square-mm", "30", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json found = run.json();
  std::printf("%s, T %s m\n", found["rms_px"].dump().c_str(), found["translation_m"].dump().c_str());
  EXPECT_EQ(found["pairs"], 13);
  for (const char* camera : {"left", "right", "stereo"}) EXPECT_LE(found["rms_px"][camera], 0.22) << camera;
  EXPECT_NEAR(1e3 * found["translation_m"][0].get<double>(), -99.802, 0.142);
  EXPECT_NEAR(1e3 * found["translation_m"][1].get<double>(), 1.124, 0.114);
  EXPECT_NEAR(1e3 * found["translation_m"][2].get<double>(), 0.050, 0.498);
}

}  // namespace
}  // namespace tankrig
