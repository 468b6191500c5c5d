// Pictures as files that people look at, and pictures from others. Frames are session/recording/png_file.hpp's.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace tankrig {

/// As PNG. `picture`: 8 bits, grey or BGR.
/// Errors: InputError if it is not.
std::string picture_png(const cv::Mat& picture);

/// As JPEG, `quality` 1 to 100. `picture`: 8 bits, grey or BGR.
/// Errors: InputError if it is not.
std::string picture_jpeg(const cv::Mat& picture, int quality);

/// cv::imdecode with OpenCV's `flags`, for every format it knows; empty if it fails. Its codecs are loaded at the first call.
/// Errors: InputError if they cannot be loaded.
cv::Mat decode_by_opencv(std::string_view bytes, int flags);

/// What the module of OpenCV's codecs does.
struct PictureCodecs {
  cv::Mat (*decode)(std::string_view bytes, int flags);
};

}  // namespace tankrig
