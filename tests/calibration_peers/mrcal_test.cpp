// Debian's mrcal on the same corners: our rms is no worse, and both say alike how well a pixel is known.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "calibration/intrinsics/projection_uncertainty.hpp"
#include "tests/calibration_peers/public_pictures.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

bool mrcal_here() {
  return std::system(
             "command -v mrcal-calibrate-cameras >/dev/null && /usr/bin/python3 -c 'import mrcal' 2>/dev/null") == 0;
}

/// By mrcal, with OpenCV's four coefficients: prints rms per corner, then sigma of each pixel.
constexpr const char* kScript = R"(
import sys, numpy as np, mrcal
m = mrcal.cameramodel(sys.argv[1])
x = mrcal.optimizer_callback(**m.optimization_inputs(), no_jacobian=True, no_factorization=True)[1]
n = mrcal.num_measurements_boards(**m.optimization_inputs())
r = x[:n].reshape(-1, 2)
print(np.sqrt(np.mean(np.sum(r * r, axis=1))))
for line in open(sys.argv[2]):
    q = np.array([float(word) for word in line.split()])
    p = 0.5 * mrcal.unproject(q, *m.intrinsics(), normalize=True)
    print(mrcal.projection_uncertainty(p, model=m, what='worstdirection-stdev'))
)";

class MrcalTest : public testing::TestWithParam<bool> {};

TEST_P(MrcalTest, FitsNoBetterAndKnowsAPixelAsWell) {
  if (!public_pictures_here()) GTEST_SKIP() << kNoPublicPictures;
  if (!mrcal_here()) GTEST_SKIP() << "Debian's mrcal and python3-mrcal are not installed";
  const bool bends = GetParam();
  const TemporaryFolder folder;
  IntrinsicsProblem problem{640, 480, checkerboard(), {}, LensModel::kK1K2P1P2, bends};
  {
    std::ofstream corners(folder.path() / "corners.vnl");
    corners.precision(17);
    corners << "# filename x y level\n";
    for (const int number : public_numbers()) {
      problem.pictures.push_back({std::to_string(number), public_board("left", number)});
      for (const Vector2d& p : problem.pictures.back().board.pixels)
        corners << fmt::format("left{:02}.jpg {} {} 0\n", number, p.x(), p.y());
    }
  }
  const IntrinsicsSolution ours = solve(problem);
  // Where boards were seen: cells of the image with at least ten corners.
  std::vector<Vector2d> pixels;
  for (int i = 0; i < ImageCoverage::kColumns * ImageCoverage::kRows; ++i)
    if (ours.coverage.corners[std::size_t(i)] >= 10)
      pixels.emplace_back((i % ImageCoverage::kColumns + 0.5) * 640 / ImageCoverage::kColumns,
                          (i / ImageCoverage::kColumns + 0.5) * 480 / ImageCoverage::kRows);
  std::string asked;
  for (const Vector2d& p : pixels) asked += fmt::format("{} {}\n", p.x(), p.y());
  folder.write("pixels", asked), folder.write("ask.py", kScript);
  const std::string command = fmt::format(
      "cd {0} && mrcal-calibrate-cameras --corners-cache corners.vnl --lensmodel LENSMODEL_OPENCV4 --focal 540 "
      "--imagersize "
      "640 480 --object-spacing .03 --object-width-n 9 --object-height-n 6 --outdir . --skip-regularization "
      "--skip-outlier-rejection {1} 'left*.jpg' >log 2>&1 && /usr/bin/python3 ask.py camera-0.cameramodel pixels "
      ">answer 2>>log",
      folder.path().string(), bends ? "" : "--skip-calobject-warp-solve");
  ASSERT_EQ(std::system(command.c_str()), 0) << folder.read("log");
  std::istringstream answer(folder.read("answer"));
  double rms = 0, worst = 1;
  answer >> rms;
  for (const Vector2d& p : pixels) {
    double theirs = 0;
    ASSERT_TRUE(answer >> theirs);
    const double ratio = ProjectionUncertainty(ours).at(p, 0.5).value().independent_px / theirs;
    if (std::abs(std::log(ratio)) > std::abs(std::log(worst))) worst = ratio;
    EXPECT_NEAR(ratio, 1, 0.2) << p.transpose() << ": mrcal " << theirs << " px";
  }
  std::printf("%s target: rms %.5f px, mrcal %.5f px; sigma of a pixel over mrcal's at %zu places: worst ratio %.3f\n",
              bends ? "bent" : "flat", ours.rms, rms, pixels.size(), worst);
  EXPECT_LE(ours.rms, rms * 1.0001);
}

INSTANTIATE_TEST_SUITE_P(Targets, MrcalTest, testing::Bool(),
                         [](const auto& target) { return target.param ? "Bent" : "Flat"; });

}  // namespace
}  // namespace tankrig
