// A stranger's program: no network, of this machine's files Debian's /usr and what it is given, all to read only, and of the
// kernel's calls those that a computation needs (call_filter.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tankrig {

struct Sandbox {
  std::vector<std::filesystem::path> readable;  ///< folders, seen inside under their own names
  std::filesystem::path work;    ///< an empty folder: inside it is one in memory, where the program starts
  std::uint64_t work_bytes = 0;  ///< the most that fits there
  std::filesystem::path made;    ///< a file below `work` that the program may leave, and nothing else
  std::filesystem::path result;  ///< what it is copied to; exists, outside of `work`
  std::filesystem::path filter;  ///< of system calls: a file to write, outside of `work` and of what is readable
};

/// The words that run `command` by bubblewrap; to be run under limits (limited_run.hpp). Root's are run as nobody:
/// everything named but the filter must be open to others. Its own processes, bwrap's and a shell's, count as the program's.
/// Errors: InputError if the filter cannot be written.
std::vector<std::string> sandboxed(const Sandbox& sandbox, const std::vector<std::string>& command);

}  // namespace tankrig
