// Curves and tables of a sweep whose values are known.
#include "bench/sweep/sweep_report.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/report/base64.hpp"
#include "bench/report/web_programs.hpp"
#include "bench/sweep/point_views.hpp"
#include "bench/sweep/strip.hpp"
#include "bench/sweep/sweep_html.hpp"
#include "tests/support/browser.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const cv::Scalar kBehind(200, 0, 200);

/// Two seeds of light 0, 0.5, 1 by noise 0, 0.1: coverage is light - noise + seed / 100.
struct Grid {
  Benchmark benchmark;
  std::map<std::size_t, nlohmann::ordered_json> rows;

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
  SweepRows swept() const {
    SweepRows swept(benchmark);
    for (const auto& [point, row] : rows) swept.add(point, row);
    return swept;
  }
};

TEST(SweepChart, HasACurveForEveryNoiseAveragedOverSeeds) {
  const Grid grid;
  const Chart chart = sweep_chart(grid.benchmark, grid.swept(), "coverage");
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
  const nlohmann::ordered_json run{{"rig", "tank-sim"},
                                   {"preset", "fine"},
                                   {"options", "--truth-seed 6"},
                                   {"sensor", "emva1288"},
                                   {"seed", 4},
                                   {"benchmark_sha256", "0123"},
                                   {"software", "9.9.9"},
                                   {"algorithms", {{"mine", "4567"}}}};
  const TemporaryFolder folder;
  folder.write("figures/views_light.png", "\x89PNG picture");
  std::string page = sweep_html(folder.path(), grid.benchmark, run, grid.swept());
  EXPECT_THAT(
      page, HasSubstr("tankrig bench grid.xml --rig tank-sim --preset fine --sensor emva1288 --truth-seed 6 --seed 4"));
  for (const char* hash : {"0123", "4567", "9.9.9"}) EXPECT_THAT(page, HasSubstr(hash));
  EXPECT_THAT(page, HasSubstr("1 configurations are missing"));
  EXPECT_THAT(page, HasSubstr("<td>laser: &lt;b&gt;ran longer than 1 s</td>"));
  EXPECT_THAT(page, HasSubstr("In the form of the paper&#39;s Figure 8"));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORyBwaWN0dXJl"));
  EXPECT_THAT(page, HasSubstr("<polyline"));
  for (auto at = page.find("http://www.w3.org/2000/svg"); at != std::string::npos;
       at = page.find("http://www.w3.org/2000/svg"))
    page.erase(at, 26);
  for (const char* foreign : {"http://", "https://", "src=\"figures", "<script src", "<link"})
    EXPECT_EQ(page.find(foreign), std::string::npos) << foreign;
  EXPECT_EQ(page.find("<script") == std::string::npos, plots_program().empty());
}

/// A page whose configuration 2, light 1 without noise, has a picture of one colour behind it.
std::string page_with_a_picture(const Grid& grid) {
  const TemporaryFolder folder;
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", cv::Mat(120, 160, CV_8UC3, kBehind), jpeg);
  add_views(folder.path(), 2, {{"laser", "laser", base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()})}});
  return sweep_html(folder.path(), grid.benchmark, {{"rig", "tank-sim"}, {"sensor", "scene"}, {"seed", 7}},
                    grid.swept());
}

/// As in a browser with JavaScript switched off.
std::string without_programs(std::string page) {
  const std::string head = "<head>";
  return page.insert(page.find(head) + head.size(),
                     "<meta http-equiv=\"Content-Security-Policy\" content=\"script-src 'none'\">");
}

/// As if a person did this to the first curve's dot at `x`, `y`.
std::string page_with_pointer_at(const Grid& grid, double x, double y, const std::string& does) {
  const auto axes = chart_json(sweep_chart(grid.benchmark, grid.swept(), "coverage"), {});
  return page_with_a_picture(grid) +
         fmt::format(R"(<script>addEventListener('load', () => {{
const over = document.querySelector('.u-over'), box = over.getBoundingClientRect(), x = {}, y = {}
const at = {{ bubbles: true, view: window, clientX: box.left + box.width * (x - {}) / {}, clientY: box.bottom - box.height * (y - {}) / {} }}
for (const type of {}) over.dispatchEvent(new MouseEvent(type, at))
}})</script>)",
                     x, y, axes["x"][0].dump(), axes["x"][1].get<double>() - axes["x"][0].get<double>(),
                     axes["y"][0].dump(), axes["y"][1].get<double>() - axes["y"][0].get<double>(), does);
}

TEST(SweepHtml, IsDrawnByABrowserInWideWindowsAndNarrowOnes) {
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  Grid grid;
  grid.rows[3]["measures"]["laser"]["error"] = "ran longer than 1 s";
  const std::string page = page_with_a_picture(grid);
  for (const std::string& as : {page, without_programs(page)}) {
    const Browser browser(as);
    for (const int width : {1280, 480}) {
      const cv::Mat drawn = browser.drawn({width, 4000});
      ASSERT_EQ(drawn.size(), cv::Size(width, 4000));
      EXPECT_THAT(browser.leads_out_to(), ::testing::IsEmpty());
      // The two curves, and the edge of the warning.
      for (const cv::Scalar& bgr : {cv::Scalar(180, 119, 31), cv::Scalar(14, 127, 255), cv::Scalar(0, 161, 224)})
        EXPECT_GT(pixels_like(drawn, bgr), 20) << width << " " << bgr << (as == page ? "" : " without programs");
      EXPECT_EQ(pixels_like(drawn, kBehind), 0) << width;
      EXPECT_TRUE(ends_inside(drawn)) << "something leads out of a window of " << width;
    }
  }
}

TEST(SweepHtml, ShowsWhatStandsBehindADotWithoutAnyProgram) {
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  const std::string page = page_with_a_picture(Grid());
  EXPECT_THAT(page, HasSubstr("<a href=\"#point-2\"><circle"));
  EXPECT_THAT(page, HasSubstr("Configuration 2: Iteration 0, Noise 0, Light 1"));
  EXPECT_THAT(page, HasSubstr("tankrig scan --rig tank-sim --noise 0 --light 1 --seed 7"));
  EXPECT_THAT(page, HasSubstr("laser; coverage of the surface [%]: 100.0; mean error [mm]: 1.000"));
  EXPECT_GT(pixels_like(Browser(without_programs(page)).drawn({480, 4000}, "#point-2"), kBehind), 5000);
}

TEST(SweepHtml, DrawsItsCurvesWithTheirValuesAndAClickShowsTheFrames) {
  if (plots_program().empty()) GTEST_SKIP() << "built without plots: TANKRIG_CLOUD_VIEW, which needs npm";
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  const Grid grid;
  const std::string still = Browser(page_with_a_picture(grid)).elements();
  EXPECT_THAT(still, HasSubstr("class=\"uplot"));
  EXPECT_EQ(still.find("<svg"), std::string::npos) << "the static curves are still there";
  EXPECT_THAT(still, HasSubstr("Permission is hereby granted, free of charge"));

  // The value of the second curve where the pointer is: light 0.5, noise 0.1, the mean of two seeds.
  EXPECT_THAT(Browser(page_with_pointer_at(grid, 0.5, 40.5, "['mousemove']")).elements(), HasSubstr(">40.5<"));

  const char* const click = "['mousemove', 'mousedown', 'mouseup', 'click']";
  for (const int width : {1280, 480}) {
    const cv::Mat on = Browser(page_with_pointer_at(grid, 1, 100.5, click)).drawn({width, 4000});
    EXPECT_GT(pixels_like(on, kBehind), 5000) << width;
    const cv::Mat beside = Browser(page_with_pointer_at(grid, 0.75, 20, click)).drawn({width, 4000});
    EXPECT_EQ(pixels_like(beside, kBehind), 0) << width;
  }
}

TEST(SweepChart, LeavesOutWhatHasNoValue) {
  Grid grid;
  for (auto& [point, row] : grid.rows)
    if (row["values"][2] == 0.5) row["measures"]["laser"]["coverage"] = nullptr;
  EXPECT_THAT(sweep_chart(grid.benchmark, grid.swept(), "coverage").panels[0].curves[0].points, SizeIs(2));
}

TEST(SweepChart, IsDrawnWithItsAxesCurvesAndUnits) {
  const Grid grid;
  const Chart chart = sweep_chart(grid.benchmark, grid.swept(), "coverage");
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
      sweep_page(grid.benchmark, {{"software", "x"}, {"rig", "r"}, {"sensor", "s"}, {"seed", 1}}, grid.swept(), {});
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
