// What the tests of pages ask of a browser.
#include "tests/support/browser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tankrig {
namespace {

TEST(BrowserOfTests, DrawsAPageAndTellsWhatItLoadsFromElsewhere) {
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  const Browser alone(
      "<body style='margin: 0'><div style='width: 500px; height: 10px; background: rgb(10, 20, 200)'></div>");
  const cv::Mat wide = alone.drawn({400, 100});
  ASSERT_EQ(wide.size(), cv::Size(400, 100));
  EXPECT_EQ(pixels_like(wide, {200, 20, 10}), 400 * 10);
  EXPECT_FALSE(ends_inside(wide));
  EXPECT_THAT(alone.leads_out_to(), testing::IsEmpty());
  const Browser leading_out("<img src='http://127.0.0.1:9/picture.png'>");
  EXPECT_TRUE(ends_inside(leading_out.drawn({400, 100})));
  EXPECT_THAT(leading_out.leads_out_to(), testing::Contains("http://127.0.0.1:9/picture.png"));
}

}  // namespace
}  // namespace tankrig
