// From the pixel formats of industrial cameras to our pictures.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

namespace tankrig {

/// How the camera sends its pixels: GenICam name, bytes per pixel, and what OpenCV does about it.
struct AravisPixels {
  enum class Kind { kMono8, kMono16, kRgb8, kBgr8, kBayer8 };
  std::string_view name;
  Kind kind = Kind::kMono8;
  int bytes = 1;
  int demosaic = -1;  ///< cv::ColorConversionCodes to BGR, of a Bayer pattern
};

std::optional<AravisPixels> aravis_pixels(std::string_view name);

/// The picture in `memory`, a continuous 8-bit row of at least size.area() pixels of the format, as 8 bit and 1 or 3
/// (BGR) channels. Shares the memory if nothing must be converted; Mono16 keeps the upper 8 bits.
cv::Mat picture_from(const cv::Mat& memory, cv::Size size, const AravisPixels& pixels, int channels);

}  // namespace tankrig
