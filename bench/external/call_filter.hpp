// Which system calls a stranger's program may make: what no computation needs, and kernels have been broken by, is not there.
#pragma once

#include <filesystem>

namespace tankrig {

/// Writes the filter as bubblewrap reads it (--seccomp). A call that is not there fails with ENOSYS, a socket of another
/// family than AF_UNIX with EAFNOSUPPORT; one of another architecture's kills.
/// Errors: InputError.
void write_call_filter(const std::filesystem::path& file);

}  // namespace tankrig
