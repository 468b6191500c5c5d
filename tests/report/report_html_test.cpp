// The report page holds every number, loads nothing, and cannot be broken by text.
#include "bench/report/report_html.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <regex>

#include "bench/report/figures.hpp"
#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

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

std::filesystem::path some_picture() {
  static const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "picture.png";
  cv::imwrite(file, cv::Mat(8, 8, CV_8UC3, cv::Scalar(1, 2, 3)));
  return file;
}

ReportData some_report() {
  ReportData data;
  data.title = "Scan <1> & \"more\"";
  data.facts = {{"operator", "O'Hara <script>alert(1)</script>"}, {"seed", "42"}};
  data.methods = {{"laser", some_metrics(), {}},
                  {"stereo",
                   {{"points", 0}, {"coverage", 0.0}, {"mean_error_m", nullptr}, {"reason", "no texture above noise"}},
                   {}}};
  data.pictures = {{"", "cloud over the object", some_picture()}};
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
        "3 frames &lt; expected", "tankrig report out&#x2F;scan"})
    EXPECT_THAT(html, HasSubstr(text));
}

/// Every text that a page shows, made of what would break out of an element, an attribute, the style or the template.
TEST(Report, EscapesWhatPeopleWrite) {
  const std::string hostile =
      "</title></style>\"'><script>alert(1)</script>&amp;{{title}}{{{title}}}{{#methods}}{{=<% %>=}}<!--";
  const std::string escaped =
      "&lt;&#x2F;title&gt;&lt;&#x2F;style&gt;&quot;&#39;&gt;&lt;script&gt;alert(1)&lt;&#x2F;script&gt;&amp;amp;{{title}"
      "}"
      "{{{title}}}{{#methods}}{{=&lt;% %&gt;=}}&lt;!--";
  ReportData data;
  data.title = data.command = hostile;
  data.warnings = {hostile};
  data.facts = {{hostile, hostile}};
  data.methods = {{hostile,
                   {{"reason", hostile},
                    {"coverage", hostile},
                    {hostile, 1.0},
                    {"coverage_at", {{hostile, 0.5}}},
                    {"thresholds", {{hostile, hostile}}}},
                   {hostile}}};
  data.pictures = {{hostile, hostile, some_picture()}};
  const std::string html = report_html(data);
  const auto count = [&](const std::string& text) {
    int found = 0;
    for (std::size_t at = html.find(text); at != std::string::npos; at = html.find(text, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<script"), 1) << "the page's own";
  EXPECT_EQ(count("<!--"), 0);
  EXPECT_EQ(count("<title>" + escaped + "</title>"), 1);
  EXPECT_EQ(count("<h1>" + escaped + "</h1>"), 1);
  EXPECT_EQ(count("<p class=\"warn\">" + escaped + "</p>"), 1);
  EXPECT_EQ(count("<tr><td>" + escaped + "</td><td>" + escaped + "</td></tr>"), 1) << "fact";
  EXPECT_EQ(count("<tr><td>" + escaped + "</td><td class=\"n\">" + escaped + "</td></tr>"), 1) << "threshold";
  EXPECT_EQ(count("<tr><td>" + escaped + "</td><td class=\"n\">1</td></tr>"), 1) << "figure";
  EXPECT_EQ(count("<th>" + escaped + "<small>" + escaped + "</small></th>"), 1) << "method";
  EXPECT_EQ(count("<a href=\"" + escaped + "\">" + escaped + "</a>"), 1);
  EXPECT_EQ(count("<h3>" + escaped + "</h3>"), 1);
  EXPECT_EQ(count("<img alt=\"" + escaped + "\" src=\"data:image/png;base64,"), 1);
  EXPECT_EQ(count("<figcaption>" + escaped + "</figcaption>"), 1);
  EXPECT_EQ(count("<code>" + escaped + "</code>"), 1);
  EXPECT_EQ(count("<summary>" + escaped + ", as written"), 1);
}

TEST(Report, LoadsNothingFromAnywhere) {
  const std::string html = report_html(some_report());
  for (const char* outside : {"http:", "https:", "//", "@import", "url(", "<link", "file:"}) {
    std::string text = html;
    // Base64 may hold anything but these words' colons; two slashes it may.
    const std::size_t begin = text.find("base64,"), end = text.find('"', begin);
    text.erase(begin, end - begin);
    text = std::regex_replace(text, std::regex("&#x2F;"), "/");
    EXPECT_EQ(text.find(outside), std::string::npos) << outside;
  }
  EXPECT_THAT(html, HasSubstr("src=\"data:image/png;base64,iVBORw0KGgo"));
}

TEST(Report, GroupsPicturesUnderTheirHeadingsAndLinksToFiles) {
  ReportData data = some_report();
  const std::filesystem::path file = some_picture();
  data.pictures = {{"", "rig", file}, {"laser", "front", file}, {"laser", "back", file}, {"stereo", "front", file}};
  data.methods[0].files = {"clouds/laser.ply", "clouds/\"odd\".ply"};
  const std::string html = report_html(data);
  EXPECT_EQ(html.find("<h3>laser</h3>"), html.rfind("<h3>laser</h3>")) << "once";
  EXPECT_LT(html.find("<h3>laser</h3>"), html.find("<h3>stereo</h3>"));
  EXPECT_THAT(html, HasSubstr("<a href=\"clouds&#x2F;laser.ply\">"));
  EXPECT_THAT(html, HasSubstr("<a href=\"clouds&#x2F;&quot;odd&quot;.ply\">"));
}

TEST(Report, ListensToItsLinksBeforeThereAreAny) {
  ReportData data = some_report();
  data.methods[0].files = {"clouds/laser.ply"};
  const std::string html = report_html(data);
  const std::size_t listens = html.find("addEventListener('click'");
  ASSERT_NE(listens, std::string::npos);
  EXPECT_LT(listens, html.find("</head>"));
  EXPECT_EQ(html.find("<a href"), html.find("<a href", listens));
}

TEST(Report, HoldsEachByteOfAPicture) {
  const TemporaryFolder folder;
  ReportData data;
  data.pictures = {{"", "four bytes", folder.write("picture.jpg", std::string("\xff\xd8\x00\xfb", 4))}};
  EXPECT_THAT(report_html(data), HasSubstr("src=\"data:image/jpeg;base64,/9gA+w==\""));
}

TEST(Report, NamesAPictureItCannotRead) {
  ReportData data = some_report();
  data.pictures = {{"", "gone", "/no/such/picture.png"}};
  try {
    report_html(data);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("/no/such/picture.png: cannot be read, expected a PNG or JPEG picture"));
  }
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
