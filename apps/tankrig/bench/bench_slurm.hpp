// `tankrig bench --slurm`: a benchmark's shards as a job array; those that are lost, once more.
#pragma once

#include <filesystem>

#include "apps/tankrig/bench/bench_run.hpp"
#include "apps/tankrig/bench/slurm.hpp"
#include "apps/tankrig/command_line/progress.hpp"

namespace tankrig::app {

/// Submits the shards that have neither all their configurations nor a task in the queue, and says where the others
/// are. Returns the exit code.
/// Errors: InputError.
int bench_on_slurm(const BenchRun& run, const SlurmArray& array, const std::filesystem::path& file, bool json,
                   Progress& progress);

}  // namespace tankrig::app
