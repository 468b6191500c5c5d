// SHA-256: proves that a session's files are the recorded ones.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tankrig {

/// 64 lower-case hexadecimal digits.
std::string sha256_of_text(std::string_view text);

/// Errors: InputError if the file cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace tankrig
