// A rendered picture put on a camera's wire: the inverse of drivers/camera/pixel_format.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

#include "drivers/camera/pixel_format.hpp"

namespace tankrig::sim {

/// Writes an 8-bit picture, 1 or 3 (BGR) channels, to `out` as kGrey, kYuyv or kBgr24, rows `stride` bytes apart. A
/// grey picture becomes YUYV's luma unchanged, with neutral chroma; a coloured one ITU-R BT.601 limited range, chroma
/// averaged over two pixels. Grey of a coloured one: 0.299 R + 0.587 G + 0.114 B. False if the format is another, the
/// width is odd for YUYV, or `out` is too small.
/// Threads: any.
/// RT: never.
bool encode(const cv::Mat& picture, PixelFormat format, std::size_t stride, std::span<std::uint8_t> out);

}  // namespace tankrig::sim
