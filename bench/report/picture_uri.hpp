// A picture as a page holds it: its bytes in the page.
#pragma once

#include <filesystem>
#include <string>

namespace tankrig {

/// "data:image/png;base64,..." of a PNG or JPEG file.
/// Errors: InputError naming the file.
std::string picture_uri(const std::filesystem::path& file);

}  // namespace tankrig
