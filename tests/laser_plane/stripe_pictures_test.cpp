// From pictures to the sheet: those of a scanner that others built.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "calibration/laser_plane/checkerboard.hpp"
#include "calibration/laser_plane/laser_plane.hpp"
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// Adds a picture's stripe points on the board to the problem, in the frame a.
void add_picture(const std::string& name, const cv::Mat& lit, const cv::Mat& dark, const Checkerboard& board,
                 const CheckerboardView& seen, const CameraModel& camera, const Transform& aMc,
                 LaserPlaneProblem& problem) {
  const StripeDetection found = detect_stripe(lit, dark, {});
  StripeLine line{found.orientation == StripeOrientation::kRows, {}};
  for (const StripePeak& peak : found.peaks)
    line.points.push_back({static_cast<int>(std::lround(peak.column)), peak.position, peak.sigma_px});
  const int group = static_cast<int>(problem.groups.size());
  problem.groups.push_back({name, {}});
  for (const PlacedStripePoint& point : points_on_board(camera, line, seen.cMt, area_of(board)))
    problem.points.push_back({aMc * point.p, std::max(point.sigma, 1e-5), group});
}

TEST(StripePictures, OfAScannerThatOthersBuiltTellItsSheet) {
  const char* folder = std::getenv("TANKRIG_REAL_STRIPES");
  if (!folder)
    GTEST_SKIP() << "TANKRIG_REAL_STRIPES is not set, expected a folder with camera.yaml and images/ of a stripe on a "
                    "checkerboard of 6x8 corners, 40 mm";
  const CameraModel camera = read_camera_file(fs::path(folder) / "camera.yaml");
  const Checkerboard board{6, 8, 0.04};
  LaserPlaneProblem problem;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(folder) / "images")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const cv::Mat picture = cv::imread(file.string());
    if (const auto seen = find_checkerboard(picture, board, camera))
      add_picture(file.filename().string(), picture, {}, board, *seen, camera, Transform::Identity(), problem);
  }
  const LaserPlaneSolution s = solve(problem);
  RecordProperty("rms_um", static_cast<int>(1e6 * s.rms));
  EXPECT_GE(problem.groups.size(), 5U);
  EXPECT_LE(s.rms, 0.00026);
  EXPECT_LE(s.held_back_rms, 0.0003);
}

TEST(Checkerboard, IsNotFoundWhereThereIsNoneOrOfAnotherSize) {
  const CameraModel camera{320, 240, 300, 300, 160, 120};
  EXPECT_FALSE(find_checkerboard(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)), {8, 6, 0.04}, camera));
  EXPECT_THROW(find_checkerboard(cv::Mat(240, 321, CV_8UC1, cv::Scalar(90)), {8, 6, 0.04}, camera), InputError);
  EXPECT_THROW(checkerboard_of("8by6", 0.04), InputError);
  EXPECT_THROW(checkerboard_of("2x6", 0.04), InputError);
  EXPECT_EQ(checkerboard_of("8x6", 0.04).rows, 6);
}

}  // namespace
}  // namespace tankrig
