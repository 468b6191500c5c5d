#include "sim_backends/wire/gige_pixels.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace tankrig::sim {
namespace {

// Bits per pixel are the second byte of the code. Source: GenICam Pixel Format Naming Convention 2.4, 32-bit values.
constexpr std::uint32_t kMono8 = 0x01080001, kMono16 = 0x01100007, kRgb8 = 0x02180014;
constexpr std::uint32_t kBayerGr8 = 0x01080008, kBayerRg8 = 0x01080009, kBayerGb8 = 0x0108000A, kBayerBg8 = 0x0108000B;

constexpr std::array<std::pair<std::string_view, std::uint32_t>, 7> kFormats{{{"Mono8", kMono8},
                                                                              {"Mono16", kMono16},
                                                                              {"RGB8", kRgb8},
                                                                              {"BayerGR8", kBayerGr8},
                                                                              {"BayerRG8", kBayerRg8},
                                                                              {"BayerGB8", kBayerGb8},
                                                                              {"BayerBG8", kBayerBg8}}};

/// BGR channel under each pixel of a 2 x 2 cell, row by row.
std::array<int, 4> bayer_cell(std::uint32_t format) {
  switch (format) {
    case kBayerGr8:
      return {1, 2, 0, 1};
    case kBayerRg8:
      return {2, 1, 1, 0};
    case kBayerGb8:
      return {1, 0, 2, 1};
    default:
      return {0, 1, 1, 2};
  }
}

cv::Mat part_of(const cv::Mat& picture, cv::Point offset, cv::Size size) {
  const cv::Rect wanted(offset, size), whole({}, picture.size());
  if ((wanted & whole) == wanted) return picture(wanted);
  cv::Mat padded = cv::Mat::zeros(size, picture.type());
  const cv::Rect common = wanted & whole;
  if (!common.empty()) picture(common).copyTo(padded(common - offset));
  return padded;
}

}  // namespace

std::uint32_t gige_pixel_format(std::string_view name) {
  for (const auto& [known, code] : kFormats)
    if (known == name) return code;
  return 0;
}

bool is_gige_format(std::uint32_t format) {
  return std::any_of(std::begin(kFormats), std::end(kFormats),
                     [&](const auto& known) { return known.second == format; });
}

std::size_t gige_bytes(cv::Size size, std::uint32_t format) {
  const std::size_t bits = format >> 16 & 0xFF;
  return static_cast<std::size_t>(size.area()) * bits / 8;
}

void write_gige_pixels(const cv::Mat& picture, cv::Point offset, cv::Size size, std::uint32_t format,
                       std::uint8_t* data) {
  const cv::Mat part = part_of(picture, offset, size);
  const bool colour = part.channels() == 3;
  if (format == kRgb8) {
    cv::Mat out(size, CV_8UC3, data);
    cv::cvtColor(part, out, colour ? cv::COLOR_BGR2RGB : cv::COLOR_GRAY2RGB);
    return;
  }
  if (format == kMono8 || format == kMono16 || !colour) {
    cv::Mat grey = part;
    cv::Mat out(size, CV_8UC1, data);
    if (format == kMono16) {
      if (colour) cv::cvtColor(part, grey, cv::COLOR_BGR2GRAY);
      cv::Mat deep(size, CV_16UC1, data);
      grey.convertTo(deep, CV_16U, 256);
    } else if (colour) {
      cv::cvtColor(part, out, cv::COLOR_BGR2GRAY);
    } else {
      part.copyTo(out);
    }
    return;
  }
  const std::array<int, 4> cell = bayer_cell(format);
  for (int y = 0; y < size.height; ++y) {
    const std::uint8_t* in = part.ptr(y);
    std::uint8_t* out = data + static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width);
    for (int x = 0; x < size.width; ++x) out[x] = in[3 * x + cell[static_cast<std::size_t>(2 * (y & 1) + (x & 1))]];
  }
}

}  // namespace tankrig::sim
