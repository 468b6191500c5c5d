// `tankrig camera preview` as a user meets it, on the simulated tank.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <opencv2/imgcodecs.hpp>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

constexpr char kPark[] = "park_rad: [0, 0.13, 0.9, 0, 0.1]";
constexpr char kOverTheBox[] = "park_rad: [0, 0.13, 1.6, 0, 0.1]";  // the sheet crosses the box, in the camera's view

fs::path rig_over_the_box() { return edited_rig(scratch_folder() / "rig", kPark, kOverTheBox); }

std::size_t lines_with(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

TEST(CameraPreview, EndsByItselfInVirtualTimeWithAPictureAPageAndALinePerRefresh) {
  const fs::path out = scratch_folder() / "see.png";
  const ProgramRun run = run_tankrig({"camera", "preview", "--out", out.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto seen = run.json();
  EXPECT_EQ(seen.at("camera"), "mono");
  EXPECT_NEAR(seen.at("frames").get<int>(), 50, 2);  // 2 s at 25 frames/s
  EXPECT_NEAR(seen.at("frames_per_s").get<double>(), 25, 0.1);
  EXPECT_NEAR(seen.at("refreshes").get<int>(), 10, 1);
  EXPECT_EQ(lines_with(run.err, "focus"), seen.at("refreshes").get<std::size_t>()) << run.err;
  EXPECT_EQ(lines_with(run.err, "laser off"), seen.at("refreshes").get<std::size_t>()) << run.err;
  EXPECT_TRUE(seen.at("stripe_points").is_null());
  EXPECT_GT(seen.at("focus").get<double>(), 0);
  const cv::Mat picture = cv::imread(out.string());
  EXPECT_EQ(picture.cols, 720);
  EXPECT_GT(picture.rows, 576);
  EXPECT_THAT(read_text(scratch_folder() / "see.html"), HasSubstr("see.png"));
  EXPECT_FALSE(fs::exists(out.string() + ".tmp"));
}

TEST(CameraPreview, TakesTheCameraTheTimeAndTheRateItIsTold) {
  const fs::path out = scratch_folder() / "see.png";
  const ProgramRun run = run_tankrig(
      {"camera", "preview", "--camera", "left", "--seconds", "1", "--rate", "12.5", "--out", out.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json().at("camera"), "left");
  EXPECT_EQ(run.json().at("width_px"), 640);
  EXPECT_NEAR(run.json().at("refreshes").get<int>(), 12, 2);
}

TEST(CameraPreview, CountsTheFramesThatTheWireLost) {
  const fs::path rig =
      edited_rig(scratch_folder() / "rig", "\nbackend: mock", "\nmock: {camera: {drop_every: 5}}\nbackend: mock");
  const ProgramRun run = run_tankrig(
      {"camera", "preview", "--rig", rig.string(), "--out", (scratch_folder() / "p.png").string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NEAR(run.json().at("lost").get<int>(), 10, 1);
  EXPECT_THAT(run.err, HasSubstr("lost 8"));
}

TEST(CameraPreview, WithTheLaserMarksTheStripeAndLeavesItOff) {
  const fs::path rig = rig_over_the_box();
  const fs::path out = scratch_folder() / "lit.png";
  const ProgramRun run = run_tankrig({"camera", "preview", "--rig", rig.string(), "--laser", "--yes", "--seconds", "1",
                                      "--out", out.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_GT(run.json().at("stripe_points").get<int>(), 300);
  EXPECT_GT(run.json().at("clipped_share").get<double>(), 0.0005);  // this laser is brighter than that camera can tell
  EXPECT_NEAR(run.json().at("frames").get<int>(), 25, 2);
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
}

TEST(CameraPreview, WithoutTheLaserTheClippedStripeIsNotThere) {
  const fs::path rig = rig_over_the_box();
  const ProgramRun run = run_tankrig({"camera", "preview", "--rig", rig.string(), "--seconds", "0.5", "--out",
                                      (scratch_folder() / "dark.png").string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json().at("clipped_share").get<double>(), 0);
}

TEST(CameraPreview, CtrlCTakesTheLaserAwayAndIsNoFailure) {
  const fs::path rig = rig_over_the_box();
  bool sent = false;
  const ProgramRun run = run_tankrig({"camera", "preview", "--rig", rig.string(), "--laser", "--yes", "--seconds",
                                      "120", "--out", (scratch_folder() / "lit.png").string(), "--json"},
                                     [&](const std::string& line, int pid) {
                                       if (!sent && line.find("stripe") != std::string::npos)
                                         sent = kill(pid, SIGINT) == 0;
                                     });
  ASSERT_TRUE(sent) << run.err;
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
  EXPECT_LT(run.json().at("frames").get<int>(), 2000);  // of 3000
}

TEST(CameraPreview, APictureThatCannotBeWrittenAnyMoreTakesTheLaserAway) {
  const fs::path rig = rig_over_the_box();
  const fs::path folder = scratch_folder() / "pictures";
  fs::create_directories(folder);
  const ProgramRun run = run_tankrig({"camera", "preview", "--rig", rig.string(), "--laser", "--yes", "--seconds",
                                      "120", "--out", (folder / "lit.png").string()},
                                     [&](const std::string& line, int) {
                                       if (line.find("stripe") != std::string::npos) fs::remove_all(folder);
                                     });
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("lit.png: cannot be written"));
  EXPECT_THAT(run.err, HasSubstr("; laser off, arm at rest"));
}

TEST(CameraPreview, TheLaserNeedsSomebodysWord) {
  const fs::path out = scratch_folder() / "lit.png";
  const ProgramRun run = run_tankrig({"camera", "preview", "--laser", "--out", out.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("--yes"));
  EXPECT_FALSE(fs::exists(out));
}

TEST(CameraPreview, TheLaserShinesForTwoMinutesAtMost) {
  const ProgramRun run = run_tankrig({"camera", "preview", "--laser", "--yes", "--seconds", "121"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("at most 120"));
}

TEST(CameraPreview, BadWordsAreNamed) {
  const ProgramRun camera =
      run_tankrig({"camera", "preview", "--camera", "nose", "--out", (scratch_folder() / "p.png").string()});
  EXPECT_EQ(camera.exit_code, 1);
  EXPECT_THAT(camera.err, HasSubstr("mono, left, right"));
  const ProgramRun out = run_tankrig({"camera", "preview", "--out", (scratch_folder() / "p.jpg").string()});
  EXPECT_EQ(out.exit_code, 1);
  EXPECT_THAT(out.err, HasSubstr(".png"));
  const ProgramRun folder = run_tankrig({"camera", "preview", "--out", "/nonexistent/p.png"});
  EXPECT_EQ(folder.exit_code, 1);
  EXPECT_THAT(folder.err, HasSubstr("/nonexistent/p.html"));
  EXPECT_EQ(run_tankrig({"camera", "preview", "--rate", "0"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"camera", "preview", "--seconds", "-1"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"camera"}).exit_code, 2);
}

TEST(CameraPreview, ExplainsItselfWithAnExample) {
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"camera", "--help"}, {"camera", "preview", "--help"}}) {
    const ProgramRun run = run_tankrig(command);
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, HasSubstr("Example: tankrig camera preview"));
  }
}

}  // namespace
}  // namespace tankrig::test
