#include "drivers/camera/aravis_pixels.hpp"

#include <array>
#include <opencv2/imgproc.hpp>

namespace tankrig {
namespace {

using Kind = AravisPixels::Kind;

// OpenCV names a Bayer pattern after its second row and column, GenICam after its first.
constexpr std::array<AravisPixels, 8> kPixels{{{"Mono8", Kind::kMono8, 1, -1},
                                               {"Mono16", Kind::kMono16, 2, -1},
                                               {"RGB8", Kind::kRgb8, 3, -1},
                                               {"BGR8", Kind::kBgr8, 3, -1},
                                               {"BayerRG8", Kind::kBayer8, 1, cv::COLOR_BayerBG2BGR},
                                               {"BayerGB8", Kind::kBayer8, 1, cv::COLOR_BayerGR2BGR},
                                               {"BayerGR8", Kind::kBayer8, 1, cv::COLOR_BayerGB2BGR},
                                               {"BayerBG8", Kind::kBayer8, 1, cv::COLOR_BayerRG2BGR}}};

cv::Mat converted(const cv::Mat& in, int code) {
  cv::Mat out;
  cv::cvtColor(in, out, code);
  return out;
}

}  // namespace

std::optional<AravisPixels> aravis_pixels(std::string_view name) {
  for (const AravisPixels& p : kPixels)
    if (p.name == name) return p;
  return std::nullopt;
}

cv::Mat picture_from(const cv::Mat& memory, cv::Size size, const AravisPixels& pixels, int channels) {
  cv::Mat raw = memory.colRange(0, size.area() * pixels.bytes).reshape(pixels.bytes == 3 ? 3 : 1, size.height);
  const bool grey = channels == 1;
  switch (pixels.kind) {
    case Kind::kMono8:
      return grey ? raw : converted(raw, cv::COLOR_GRAY2BGR);
    case Kind::kMono16: {
      // Little-endian pairs: the second byte of each is its upper half.
      cv::Mat upper;
      cv::extractChannel(raw.reshape(2, size.height), upper, 1);
      return grey ? upper : converted(upper, cv::COLOR_GRAY2BGR);
    }
    case Kind::kRgb8:
      return converted(raw, grey ? cv::COLOR_RGB2GRAY : cv::COLOR_RGB2BGR);
    case Kind::kBgr8:
      return grey ? converted(raw, cv::COLOR_BGR2GRAY) : raw;
    case Kind::kBayer8: {
      const cv::Mat colour = converted(raw, pixels.demosaic);
      return grey ? converted(colour, cv::COLOR_BGR2GRAY) : colour;
    }
  }
  return {};
}

}  // namespace tankrig
