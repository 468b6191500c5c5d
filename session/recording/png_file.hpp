// Frames as PNG files.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace tankrig {

/// Writes `image` so that it is read fast: no filter, the least compression, one block of data; always the same bytes.
/// Errors: InputError naming the file.
std::string png_of(const cv::Mat& image, const std::filesystem::path& file);

/// The picture in a PNG of grey or colour in 8 bits, channels in OpenCV's order; empty for any other kind of PNG, and
/// where the data do not fit the size that is stated. CRCs are is_whole_png's. Several times as fast as cv::imdecode.
cv::Mat decode_plain_png(std::string_view png);

/// Whether `bytes` are a PNG from its signature to its end, with every chunk's CRC right. Nothing is decoded.
bool is_whole_png(std::string_view bytes);

/// How many of `bytes` are such a PNG, whatever follows; 0 if none.
std::size_t whole_png_size(std::string_view bytes);

}  // namespace tankrig
