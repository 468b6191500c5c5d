// Pictures as a GigE Vision camera sends them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace tankrig::sim {

/// The 32-bit pixel format code of the GenICam Pixel Format Naming Convention; 0 for one that is not emulated.
std::uint32_t gige_pixel_format(std::string_view name);

bool is_gige_format(std::uint32_t format);

/// Of a picture of that size, without padding.
std::size_t gige_bytes(cv::Size size, std::uint32_t format);

/// Writes the part of `picture` at `offset` of size `size`, in the format, without padding; black outside the picture.
/// `data` has gige_bytes() bytes.
void write_gige_pixels(const cv::Mat& picture, cv::Point offset, cv::Size size, std::uint32_t format,
                       std::uint8_t* data);

}  // namespace tankrig::sim
