// The photographs' part of the table of detectors: straight pieces of stripes, whose points are judged by lines.
#pragma once

#include <filesystem>

namespace tankrig {

/// Prints a row per set of photographs in `folder`; a set that is not there is named in one line.
/// Errors: InputError for a photograph or camera file that cannot be read.
void print_photographs(const std::filesystem::path& folder);

}  // namespace tankrig
