#include "sim_backends/wire/v4l2_encode.hpp"

#include <opencv2/imgproc.hpp>

namespace tankrig::sim {
namespace {

constexpr int kOne = 1 << 16, kHalf = kOne / 2;

std::uint8_t luma(const std::uint8_t* bgr) {
  return static_cast<std::uint8_t>(16 + ((16829 * bgr[2] + 33039 * bgr[1] + 6416 * bgr[0] + kHalf) >> 16));
}

/// `twice` weights the sum of two pixels.
std::uint8_t chroma(int red, int green, int blue, int r, int g, int b) {
  return cv::saturate_cast<std::uint8_t>(128 + ((r * red + g * green + b * blue + kOne) >> 17));
}

void yuyv_row_of_grey(const std::uint8_t* in, std::uint8_t* out, int width) {
  for (int x = 0; x < width; ++x) {
    out[2 * x] = in[x];
    out[2 * x + 1] = 128;
  }
}

void yuyv_row_of_bgr(const std::uint8_t* in, std::uint8_t* out, int width) {
  for (int x = 0; x < width; x += 2, in += 6, out += 4) {
    const int blue = in[0] + in[3], green = in[1] + in[4], red = in[2] + in[5];
    out[0] = luma(in);
    out[1] = chroma(red, green, blue, -9714, -19070, 28784);
    out[2] = luma(in + 3);
    out[3] = chroma(red, green, blue, 28784, -24103, -4681);
  }
}

}  // namespace

bool encode(const cv::Mat& picture, PixelFormat format, std::size_t stride, std::span<std::uint8_t> out) {
  const int width = picture.cols, height = picture.rows;
  if (picture.empty() || picture.depth() != CV_8U || (picture.channels() != 1 && picture.channels() != 3)) return false;
  if (stride < row_bytes(format, width) || out.size() < picture_bytes(format, width, height, stride)) return false;
  const bool grey = picture.channels() == 1;
  if (format == PixelFormat::kYuyv) {
    if (width % 2 != 0) return false;
    for (int y = 0; y < height; ++y)
      (grey ? yuyv_row_of_grey : yuyv_row_of_bgr)(picture.ptr(y), out.data() + stride * static_cast<std::size_t>(y),
                                                  width);
    return true;
  }
  if (format != PixelFormat::kGrey && format != PixelFormat::kBgr24) return false;
  const int channels = format == PixelFormat::kGrey ? 1 : 3;
  cv::Mat wire(height, width, CV_8UC(channels), out.data(), stride);
  if (channels == picture.channels())
    picture.copyTo(wire);
  else
    cv::cvtColor(picture, wire, grey ? cv::COLOR_GRAY2BGR : cv::COLOR_BGR2GRAY);
  return true;
}

}  // namespace tankrig::sim
