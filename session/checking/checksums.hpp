// SHA256SUMS: the seal on a finished session, in the format of sha256sum(1).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tankrig {

/// A file that is not as SHA256SUMS says.
struct ChecksumDifference {
  enum class Kind : std::uint8_t { kChanged, kMissing, kNotListed };
  std::string file;  ///< relative to the session
  Kind kind;
};

/// "FILE: changed", "FILE: missing" or "FILE: not listed".
std::string in_words(const ChecksumDifference& difference);

/// Whether a file was made from the recording, and may be made again: clouds/, results/, pictures/, report.html.
bool is_derived(const std::string& file);

/// Writes SHA256SUMS over every file below `session` but itself and what is unfinished, sorted by name, when all of it
/// is on the disk. What was recorded keeps the sum it was sealed with, so later damage stays visible; clouds/,
/// results/, pictures/ and report.html get new ones. A session with frames in its spool is not finished, and not
/// sealed.
/// Errors: InputError naming the file that cannot be read or written; NotOnDisk, and then there is no new seal.
void write_checksums(const std::filesystem::path& session);

/// What differs from SHA256SUMS; nothing: as sealed.
/// Errors: InputError if there is no SHA256SUMS, or it is cut, or a line of it is malformed.
std::vector<ChecksumDifference> compare_checksums(const std::filesystem::path& session);

}  // namespace tankrig
