// Two sessions file by file: which bytes differ, and where.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tankrig::app {

/// Empty: the two files hold the same bytes, but for columns of a table that its recorder did not write yet. Else "line
/// 12 differs" of text, "byte 1234 differs", or that one is missing.
std::string difference(const std::filesystem::path& recorded, const std::filesystem::path& replayed);

/// Every file of a session, relative to it, sorted.
std::vector<std::string> files_of(const std::filesystem::path& session);

}  // namespace tankrig::app
