// A session's folder: its files are opened below it, and no link leads out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace tankrig {

/// Call this before reading, mending or extending a session.
/// Errors: InputError naming the first symbolic link below `session`.
void refuse_links(const std::filesystem::path& session);

/// The regular file `name` below `session`, opened folder by folder without following a link.
/// Errors: InputError as of read_regular_file(); also if `name` leads outside.
std::string read_below(const std::filesystem::path& session, const std::filesystem::path& name, std::uint64_t most,
                       const std::string& expected);

/// session / name. Makes missing parent folders.
/// Errors: InputError if a folder cannot be made, is a link or not a folder, or leads outside.
std::filesystem::path place_below(const std::filesystem::path& session, const std::filesystem::path& name);

}  // namespace tankrig
