// Frames as PNG files.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace tankrig {

/// Writes `image`, compressed for speed (Huffman codes only, because noise does not repeat): always the same bytes.
/// Errors: InputError naming the file.
std::string png_of(const cv::Mat& image, const std::filesystem::path& file);

/// Whether `bytes` are a PNG from its signature to its end, with every chunk's CRC right. Nothing is decoded.
bool is_whole_png(std::string_view bytes);

/// How many of `bytes` are such a PNG, whatever follows; 0 if none.
std::size_t whole_png_size(std::string_view bytes);

}  // namespace tankrig
