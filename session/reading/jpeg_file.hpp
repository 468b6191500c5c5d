// Pictures of imported sessions as JPEG files.
#pragma once

#include <string_view>

namespace tankrig {

/// Whether `bytes` are a JPEG from its first marker to its end-of-image marker, segment by segment. Nothing is decoded:
/// a JPEG carries no check sum, and decoders make a picture of half a file. What stands after the end is not looked at.
bool is_whole_jpeg(std::string_view bytes);

}  // namespace tankrig
