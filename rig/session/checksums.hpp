// SHA256SUMS: the seal on a finished session, in the format of sha256sum(1).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tankrig {

/// Writes SHA256SUMS over every file below `session` but itself and unfinished *.tmp, sorted by name. What was recorded
/// keeps the sum it was sealed with, so later damage stays visible; clouds/, results/, pictures/ and report.html get new
/// ones.
/// Errors: InputError naming the file that cannot be read or written.
void write_checksums(const std::filesystem::path& session);

/// What differs from SHA256SUMS, one line a file: changed, missing, or not listed. Empty: as sealed.
/// Errors: InputError if there is no SHA256SUMS or a line of it is malformed.
std::vector<std::string> check_checksums(const std::filesystem::path& session);

}  // namespace tankrig
