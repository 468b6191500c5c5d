// Somebody's program, run where it can do little harm: its time, memory, disk and processes are limited.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tankrig {

struct RunLimits {
  double wall_s = 60;
  double cpu_s = 60;                        ///< of all its processes together
  std::uint64_t memory_bytes = 2ULL << 30;  ///< address space of each process, and what all have in memory
  std::uint64_t disk_bytes = 256ULL << 20;  ///< of each file, and of all that it adds to its folder
  int processes = 64;                       ///< at a time
};

/// What is run, and where: `folder` is its own, with its working directory `work`. All it prints goes to
/// `output.txt` there.
struct LimitedRun {
  std::vector<std::string> command;  ///< the program's path, then its arguments
  std::filesystem::path folder;
  RunLimits limits;
};

/// Runs it to its end, in a process group of its own, with a small environment and nothing to read. When it ends, or
/// breaks a limit, everything that it started is killed, what left its group too. Returns what went wrong, "ran longer
/// than 60 s"; empty: it ended with exit code 0. `caller`: a descriptor whose hang-up ends the run; -1: none.
/// Threads: the only one of its process, which from then on adopts what its descendants leave behind.
std::string supervise(const LimitedRun& run, int caller);

/// supervise() in a process of its own: this program, called again with `words` and the folder. Its supervisor ends
/// the run if this process dies.
/// Threads: any.
/// Errors: InputError if no process can be started.
std::string run_limited(const std::vector<std::string>& words, const LimitedRun& run, const std::atomic<bool>& stop);

/// The other side of run_limited(), with the folder as its argument after `words`: supervises, and says on standard output
/// how the run ended.
/// Errors: InputError.
void supervise_for_caller(const std::filesystem::path& folder);

/// The last line that it printed, for a message, without the path of the folder `hidden`; empty if there is none.
std::string last_words(const LimitedRun& run, const std::filesystem::path& hidden = {});

}  // namespace tankrig
