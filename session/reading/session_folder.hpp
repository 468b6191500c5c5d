// A session's folder: what is named in it is opened below it, and no link leads out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace tankrig {

/// Whoever opens a session to read, mend or add to it asks this first.
/// Errors: InputError naming the first symbolic link below `session`.
void refuse_links(const std::filesystem::path& session);

/// The regular file `name` below `session`, opened folder by folder without following a link.
/// Errors: InputError as of read_regular_file(); also if `name` leads outside.
std::string read_below(const std::filesystem::path& session, const std::filesystem::path& name, std::uint64_t most,
                       const std::string& expected);

/// session / name. Makes the folders of `name` that are missing.
/// Errors: InputError if one of them cannot be made, is a link or anything else, or leads outside.
std::filesystem::path place_below(const std::filesystem::path& session, const std::filesystem::path& name);

}  // namespace tankrig
