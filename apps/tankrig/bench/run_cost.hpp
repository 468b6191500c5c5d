// What a run has cost this machine, in figures that do not depend on what else runs on it.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tankrig::app {

/// Processor time so far, of this process and of the programs that it has run [s].
double processor_s();

/// The most memory that this process has had [MiB].
double peak_mib();

/// Of all files in a folder.
std::uintmax_t bytes_in(const std::filesystem::path& folder);

}  // namespace tankrig::app
