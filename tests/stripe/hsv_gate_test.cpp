// The paper's gate without an HSV picture.
#include "reconstruction/stripe/hsv_gate.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace tankrig {
namespace {

/// Every colour there is.
cv::Mat all_colours() {
  cv::Mat colours(1 << 12, 1 << 12, CV_8UC3);
  int colour = 0;
  for (int y = 0; y < colours.rows; ++y)
    for (int x = 0; x < colours.cols; ++x, ++colour)
      colours.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(colour), static_cast<std::uint8_t>(colour >> 8),
                                     static_cast<std::uint8_t>(colour >> 16)};
  return colours;
}

TEST(HsvGate, SaysOfEveryColourWhatAnHsvPictureSays) {
  const cv::Mat colours = all_colours();
  cv::Mat hsv, mask;
  cv::cvtColor(colours, hsv, cv::COLOR_BGR2HSV);
  const ByteRange gates[][3] = {{{15, 91}, {0, 90}, {181, 255}},  // the laboratory's
                                {{33, 118}, {0, 255}, {40, 255}},
                                {{0, 0}, {255, 255}, {0, 255}},
                                {{120, 179}, {17, 201}, {3, 77}},
                                {{60, 60}, {128, 128}, {0, 255}}};
  for (const auto& [hue, saturation, value] : gates) {
    const HsvGate passes(hue, saturation, value);
    cv::inRange(hsv, cv::Scalar(hue.min, saturation.min, value.min), cv::Scalar(hue.max, saturation.max, value.max),
                mask);
    int others = 0;
    for (int y = 0; y < colours.rows; ++y)
      for (int x = 0; x < colours.cols; ++x)
        others += passes(colours.ptr(y) + 3 * x) != (mask.at<std::uint8_t>(y, x) != 0);
    EXPECT_EQ(others, 0) << "hue " << hue.min << " to " << hue.max;
    EXPECT_GT(cv::countNonZero(mask), 0);
  }
}

}  // namespace
}  // namespace tankrig
