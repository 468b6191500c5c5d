// Decodes one picture of a motion-JPEG stream, without terminal output whatever its bytes are.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

#include "core/result.hpp"

namespace tankrig {

/// A baseline JPEG of exactly `width` x `height` to 1 or 3 (BGR) channels. Missing Huffman tables are the standard's
/// (the USB video class leaves them out); bytes between segments are passed over.
/// Errors: kProtocol if it is cut, damaged, of another size, or no JPEG.
/// Threads: any.
/// RT: never.
Result<cv::Mat> decode_jpeg(std::span<const std::uint8_t> bytes, int width, int height, int channels);

}  // namespace tankrig
