// What the tests of pages ask of a browser.
#include "tests/support/browser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tankrig::testing_support {
namespace {

TEST(Browser, DrawsAPageAndTellsWhatItLoadsFromElsewhere) {
  if (!has_browser()) GTEST_SKIP() << kNoBrowser;
  const char* const kWide =
      "<body style='margin: 0'><div style='width: 500px; height: 10px; background: rgb(10, 20, 200)'></div>";
  const DrawnPage alone = drawn_by_browser(kWide, {400, 100});
  ASSERT_EQ(alone.picture.size(), cv::Size(400, 100));
  EXPECT_EQ(pixels_like(alone.picture, {200, 20, 10}), 400 * 10);
  EXPECT_TRUE(is_cut_off(alone.picture));
  EXPECT_THAT(alone.leads_out_to, testing::IsEmpty());
  const DrawnPage leading_out = drawn_by_browser("<img src='http://127.0.0.1:9/picture.png'>", {400, 100});
  EXPECT_FALSE(is_cut_off(leading_out.picture));
  EXPECT_THAT(leading_out.leads_out_to, testing::Contains("http://127.0.0.1:9/picture.png"));
}

}  // namespace
}  // namespace tankrig::testing_support
