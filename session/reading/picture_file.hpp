// Picture files from others: their size is checked before they are decoded.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/input_error.hpp"

namespace tankrig {

/// Size that a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM states at its beginning [px]; nothing for other formats. Nothing
/// is decoded, so the rest of the file may disagree.
std::optional<cv::Size> picture_size(std::string_view bytes);

/// Whether `bytes` are a JPEG from its first marker to its end-of-image marker, segment by segment. Nothing is decoded:
/// a JPEG has no check sum, and decoders make a picture of half a file. Bytes after the end are ignored.
bool is_whole_jpeg(std::string_view bytes);

/// The size a picture must have, and the source of that size.
struct ExpectedSize {
  int width = 0, height = 0;
  std::string as;  ///< "as in the camera file"
};

/// A picture that is cut short or damaged, or none at all.
class DamagedPicture : public InputError {
 public:
  using InputError::InputError;
};

/// Decodes `bytes` of `file` with OpenCV's `flags`. `expected` is null if no size is known.
/// Errors: InputError if the size is wrong, or the picture has more pixels than any camera; DamagedPicture if the format
/// is unknown, the file ends before its picture, a PNG's check sum is wrong, or the decoder had to make up part of a JPEG.
/// BMP, TIFF, PGM and PPM have no check sums: a wrong pixel there is a pixel.
cv::Mat decode_picture(std::string_view bytes, const std::filesystem::path& file, const ExpectedSize* expected,
                       int flags);

}  // namespace tankrig
