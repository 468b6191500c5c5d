// SHA256SUMS: the seal on a finished session, in the format of sha256sum(1).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tankrig {

/// A file that differs from SHA256SUMS.
struct ChecksumDifference {
  enum class Kind : std::uint8_t { kChanged, kMissing, kNotListed };
  std::string file;  ///< relative to the session
  Kind kind;
};

/// "FILE: changed", "FILE: missing" or "FILE: not listed".
std::string in_words(const ChecksumDifference& difference);

/// Whether a file is a result and can be made again: clouds/, results/, pictures/, report.html.
bool is_derived(const std::string& file);

/// Writes SHA256SUMS over every finished file below `session` except itself, sorted by name, once all of them are on
/// the disk. Recorded files keep their first sum, so later damage stays visible; clouds/, results/, pictures/ and
/// report.html get new sums. A session with frames in its spool is not finished and not sealed.
/// Errors: InputError naming the file that cannot be read or written; NotOnDisk: no new seal.
void write_checksums(const std::filesystem::path& session);

/// What differs from SHA256SUMS; empty: nothing.
/// Errors: InputError if SHA256SUMS is missing, cut, or has a malformed line.
std::vector<ChecksumDifference> compare_checksums(const std::filesystem::path& session);

}  // namespace tankrig
