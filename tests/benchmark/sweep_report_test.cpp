// Curves and tables of a sweep whose values are known.
#include "bench/sweep/sweep_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/sweep/strip.hpp"
#include "bench/sweep/sweep_html.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace testing_support;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Two seeds of light 0, 0.5, 1 by noise 0, 0.1: coverage is light - noise + seed / 100.
struct Grid {
  Benchmark benchmark;
  PointRows rows;

  Grid() {
    const auto loop = [&](UpdaterKind kind, double last, double step) {
      Updater updater;
      updater.kind = kind;
      updater.last = last;
      updater.step = step;
      benchmark.updaters.push_back(updater);
    };
    loop(UpdaterKind::kRepeat, 1, 1);
    loop(UpdaterKind::kNoise, 0.1, 0.1);
    loop(UpdaterKind::kLight, 1, 0.5);
    benchmark.file = "grid.xml";
    Measure laser;
    laser.kind = MeasureKind::kReconstruction3D;
    laser.name = laser.topic = "laser";
    benchmark.measures.push_back(laser);
    for (std::size_t point = 0; point < benchmark.points(); ++point) {
      const auto v = benchmark.values(point);
      rows[point] = {{"values", v},
                     {"measures", {{"laser", {{"coverage", v[2] - v[1] + v[0] / 100}, {"mean_error", 0.001}}}}}};
    }
  }
};

TEST(SweepChart, HasACurveForEveryNoiseAveragedOverSeeds) {
  const Grid grid;
  const Chart chart = sweep_chart(grid.benchmark, grid.rows, "coverage");
  ASSERT_THAT(chart.panels, SizeIs(1));
  ASSERT_THAT(chart.panels[0].curves, SizeIs(2));
  const ChartCurve& noisy = chart.panels[0].curves[1];
  EXPECT_EQ(noisy.name, "Noise 0.1");
  ASSERT_THAT(noisy.points, SizeIs(3));
  EXPECT_DOUBLE_EQ(noisy.points[1].x, 0.5);
  EXPECT_NEAR(noisy.points[1].y, 40.5, 1e-9);
}

TEST(SweepHtml, HoldsFiguresTablesFailuresAndWhatMakesItAgain) {
  Grid grid;
  grid.rows[3]["measures"]["laser"]["error"] = "<b>ran longer than 1 s";
  grid.rows.erase(5);
  const nlohmann::ordered_json run{{"rig", "tank-sim"},           {"preset", "fine"},
                                   {"sensor", "emva1288"},        {"seed", 4},
                                   {"options", "--truth-seed 6"}, {"benchmark_sha256", "0123"},
                                   {"software", "9.9.9"},         {"algorithms", {{"mine", "4567"}}}};
  const TemporaryFolder folder;
  folder.write("figures/views_light.png", "\x89PNG picture");
  const std::string page = sweep_html(folder.path(), grid.benchmark, run, grid.rows);
  EXPECT_THAT(
      page, HasSubstr("tankrig bench grid.xml --rig tank-sim --preset fine --sensor emva1288 --truth-seed 6 --seed 4"));
  for (const char* hash : {"0123", "4567", "9.9.9"}) EXPECT_THAT(page, HasSubstr(hash));
  EXPECT_THAT(page, HasSubstr("1 configurations are missing"));
  EXPECT_THAT(page, HasSubstr("<td>laser: &lt;b&gt;ran longer than 1 s</td>"));
  EXPECT_THAT(page, HasSubstr("In the form of the paper&#39;s Figure 8"));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORyBwaWN0dXJl"));
  EXPECT_THAT(page, HasSubstr("<polyline"));
  for (const char* foreign : {"http://", "https://", "src=\"figures", "<script"}) {
    std::string rest = page;
    for (auto at = rest.find("http://www.w3.org/2000/svg"); at != std::string::npos;
         at = rest.find("http://www.w3.org/2000/svg"))
      rest.erase(at, 26);
    EXPECT_EQ(rest.find(foreign), std::string::npos) << foreign;
  }
}

TEST(SweepHtml, IsDrawnByABrowserInWideWindowsAndNarrowOnes) {
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  Grid grid;
  grid.rows[3]["measures"]["laser"]["error"] = "ran longer than 1 s";
  const TemporaryFolder folder;
  const std::string page = sweep_html(folder.path(), grid.benchmark, {{"rig", "tank-sim"}}, grid.rows);
  for (const int width : {1280, 480}) {
    const DrawnPage drawn = drawn_by_browser(page, {width, 4000});
    ASSERT_EQ(drawn.picture.size(), cv::Size(width, 4000));
    EXPECT_THAT(drawn.leads_out_to, IsEmpty());
    // The two curves, and the edge of the warning.
    for (const cv::Scalar& bgr : {cv::Scalar(180, 119, 31), cv::Scalar(14, 127, 255), cv::Scalar(0, 161, 224)})
      EXPECT_GT(pixels_like(drawn.picture, bgr), 20) << width << " " << bgr;
    EXPECT_FALSE(is_cut_off(drawn.picture)) << "window of " << width;
  }
}

TEST(SweepChart, LeavesOutWhatHasNoValue) {
  Grid grid;
  for (auto& [point, row] : grid.rows)
    if (row["values"][2] == 0.5) row["measures"]["laser"]["coverage"] = nullptr;
  EXPECT_THAT(sweep_chart(grid.benchmark, grid.rows, "coverage").panels[0].curves[0].points, SizeIs(2));
}

TEST(SweepChart, IsDrawnWithItsAxesCurvesAndUnits) {
  const Grid grid;
  const Chart chart = sweep_chart(grid.benchmark, grid.rows, "coverage");
  const std::string svg = chart_svg(chart);
  EXPECT_THAT(svg, HasSubstr("coverage of the surface [%]"));
  EXPECT_THAT(svg, HasSubstr("ambient light [share of the reference]"));
  EXPECT_THAT(svg, HasSubstr("Noise 0.1"));
  const cv::Mat picture = chart_picture(chart);
  int coloured = 0;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const cv::Vec3b c = picture.at<cv::Vec3b>(y, x);
      coloured += std::abs(c[0] - c[2]) > 60;
    }
  EXPECT_GT(coloured, 500);
}

TEST(SweepPage, AveragesWhatItsWordsName) {
  const Grid grid;
  const std::string page =
      sweep_page(grid.benchmark, {{"software", "x"}, {"rig", "r"}, {"sensor", "s"}, {"seed", 1}}, grid.rows, {});
  EXPECT_THAT(page, HasSubstr("12 configurations of 12, 0 failed"));
  EXPECT_THAT(
      page,
      HasSubstr("| laser: coverage [%], everywhere | about 50 in almost every situation | 45.5 (-10.0 to 101.0) |"));
  EXPECT_THAT(page, HasSubstr("| 0.1 | 40.5 (-10.0 to 91.0) |"));
  EXPECT_THAT(page, HasSubstr("| laser: mean error [mm], everywhere | 4 | 1.000 (1.000 to 1.000) |"));
}

TEST(ViewStrip, PutsViewsSideBySide) {
  const cv::Mat view(120, 160, CV_8UC1, cv::Scalar(100));
  const cv::Mat strip = view_strip({{"a", view}, {"b", view}, {"c", view}}, 2, 80);
  EXPECT_EQ(strip.size(), cv::Size(2 * 84 + 4, 2 * 64 + 4));
  EXPECT_EQ(strip.at<cv::Vec3b>(20, 40), cv::Vec3b(100, 100, 100));
  EXPECT_EQ(strip.at<cv::Vec3b>(100, 130), cv::Vec3b(255, 255, 255));
}

}  // namespace
}  // namespace tankrig
