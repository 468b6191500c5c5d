// Pictures as files, not to be trusted: their size is read, and compared, before they are decoded.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace tankrig {

/// Size that a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM states at its beginning [px]; nothing if `bytes` are none of them.
/// Nothing is decoded, and the rest of the file may say otherwise.
std::optional<cv::Size> picture_size(std::string_view bytes);

/// Whether `bytes` are a JPEG from its first marker to its end-of-image marker, segment by segment. Nothing is decoded:
/// a JPEG carries no check sum, and decoders make a picture of half a file. What stands after the end is not looked at.
bool is_whole_jpeg(std::string_view bytes);

/// The size a picture must have, and where that is said.
struct ExpectedSize {
  int width = 0, height = 0;
  std::string as;  ///< "as in the camera file"
};

/// `bytes` of `file` decoded with OpenCV's `flags`; `expected` may be null where nothing is known.
/// Errors: InputError if they are no picture of a known kind, a JPEG that is cut short, of another size, or of more
/// pixels than any camera has.
cv::Mat decode_picture(std::string_view bytes, const std::filesystem::path& file, const ExpectedSize* expected,
                       int flags);

}  // namespace tankrig
