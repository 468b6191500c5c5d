// The report page holds every number, loads nothing, and cannot be broken by text.
#include "bench/report/report_html.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "bench/report/figures.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

nlohmann::json some_metrics() {
  return {{"points", 12345},
          {"mean_error_m", 0.000312},
          {"stddev_m", 0.000201},
          {"coverage", 0.3812},
          {"coverage_ceiling", 0.39},
          {"coverage_of_ceiling", 0.977},
          {"outliers", 0.00416},
          {"outlier_count", 51},
          {"rejected", 0.05},
          {"bias_m", -0.0001},
          {"coverage_at", {{"0.002", 0.301}, {"0.010", 0.3812}}},
          {"coverage_of_ceiling_at", {{"0.002", 0.77}, {"0.010", 0.977}}},
          {"thresholds",
           {{"inlier_m", 0.01}, {"outlier_m", 0.01}, {"coverage_headline_m", 0.01}, {"max_incidence_deg", 75.0}}}};
}

ReportData some_report() {
  ReportData data;
  data.title = "Scan <1> & \"more\"";
  data.facts = {{"operator", "O'Hara <script>alert(1)</script>"}, {"seed", "42"}};
  data.methods = {{"laser", some_metrics(), {}},
                  {"stereo",
                   {{"points", 0}, {"coverage", 0.0}, {"mean_error_m", nullptr}, {"reason", "no texture above noise"}},
                   {}}};
  data.pictures = {{"", "cloud over the object", cv::Mat(8, 8, CV_8UC3, cv::Scalar(1, 2, 3)), {}}};
  data.warnings = {"3 frames < expected"};
  data.command = "tankrig report out/scan";
  return data;
}

TEST(Report, ShowsThePapersFourFiguresWithThresholdsAndCeilingsFirst) {
  const std::string html = report_html(some_report());
  const std::size_t four = html.find("The four figures"), pictures = html.find("<h2>Pictures</h2>"),
                    all = html.find("All figures");
  ASSERT_NE(four, std::string::npos);
  EXPECT_LT(four, pictures);
  EXPECT_LT(pictures, all);
  const std::string table = html.substr(four, pictures - four);
  EXPECT_THAT(table, HasSubstr("0.312 mm<small>of points within 10 mm"));
  EXPECT_THAT(table, HasSubstr("0.201 mm"));
  EXPECT_THAT(table, HasSubstr("38.1 %<small>97.7 % of its ceiling 39.0 %; at 10 mm"));
  EXPECT_THAT(table, HasSubstr("0.42 %<small>51 points beyond 10 mm"));
  EXPECT_THAT(table, HasSubstr("12345<small>5.0 % not on the object"));
  EXPECT_THAT(table, HasSubstr("no texture above noise"));
  EXPECT_THAT(table, HasSubstr("<td class=\"n\">none")) << "an empty cloud has no error figure";
}

TEST(Report, HoldsEveryFigureAndThreshold) {
  const std::string html = report_html(some_report());
  for (const char* text :
       {"-0.100 mm", "77.0 % of its ceiling", "30.1 %", "2 mm", "ceiling: seen and lit less steeply than", "75°", "42",
        "3 frames &lt; expected", "tankrig report out/scan"})
    EXPECT_THAT(html, HasSubstr(text));
}

TEST(Report, EscapesWhatPeopleWrite) {
  const std::string html = report_html(some_report());
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_THAT(html, HasSubstr("O&#39;Hara &lt;script&gt;"));
  EXPECT_THAT(html, HasSubstr("<title>Scan &lt;1&gt; &amp; &quot;more&quot;</title>"));
}

TEST(Report, LoadsNothingFromAnywhere) {
  const std::string html = report_html(some_report());
  for (const char* outside : {"http:", "https:", "//", "@import", "url(", "<link", "file:"}) {
    std::string text = html;
    // Base64 may hold anything but these words' colons; two slashes it may.
    const std::size_t begin = text.find("base64,"), end = text.find('"', begin);
    text.erase(begin, end - begin);
    EXPECT_EQ(text.find(outside), std::string::npos) << outside;
  }
  EXPECT_THAT(html, HasSubstr("src=\"data:image/png;base64,iVBORw0KGgo"));
}

TEST(Report, GroupsPicturesUnderTheirHeadingsAndLinksToFiles) {
  ReportData data = some_report();
  const cv::Mat image(8, 8, CV_8UC3, cv::Scalar(1, 2, 3));
  data.pictures = {{"", "rig", image, {}},
                   {"laser", "front", image, {}},
                   {"laser", "back", image, {}},
                   {"stereo", "front", image, {}}};
  data.methods[0].files = {"clouds/laser.ply", "clouds/\"odd\".ply"};
  const std::string html = report_html(data);
  EXPECT_EQ(html.find("<h3>laser</h3>"), html.rfind("<h3>laser</h3>")) << "once";
  EXPECT_LT(html.find("<h3>laser</h3>"), html.find("<h3>stereo</h3>"));
  EXPECT_THAT(html, HasSubstr("<a href=\"clouds/laser.ply\">"));
  EXPECT_THAT(html, HasSubstr("<a href=\"clouds/&quot;odd&quot;.ply\">"));
}

TEST(Report, NamesAPictureItCannotRead) {
  ReportData data = some_report();
  data.pictures = {{"", "gone", {}, "/no/such/picture.png"}};
  try {
    report_html(data);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("/no/such/picture.png: cannot be read, expected a PNG or JPEG picture"));
  }
}

TEST(Base64, AgreesWithRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xff\xfe\x00", 3)), "//4A");
}

TEST(Figures, CarryTheirUnits) {
  const nlohmann::json m{{"mean_error_m", 0.0123456},
                         {"surface_area_m2", 0.2248},
                         {"points", 7},
                         {"outliers", 0.0},
                         {"stddev_m", nullptr}};
  EXPECT_EQ(shown_figure(m, "mean_error_m"), "12.346 mm");
  EXPECT_EQ(shown_figure(m, "surface_area_m2"), "0.2248 m²");
  EXPECT_EQ(shown_figure(m, "points"), "7");
  EXPECT_EQ(shown_figure(m, "outliers"), "0.0 %");
  EXPECT_EQ(shown_figure(m, "stddev_m"), "none");
  EXPECT_EQ(shown_figure(m, "nothing_such"), "none");
  EXPECT_EQ(millimetres(0.002), "2 mm");
  EXPECT_EQ(millimetres(0.0025), "2.500 mm");
}

}  // namespace
}  // namespace tankrig
