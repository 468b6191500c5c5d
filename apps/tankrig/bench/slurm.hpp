// Shards as tasks of a Slurm job array: sbatch starts them, squeue says which are not over.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace tankrig::app {

/// A job array whose task i runs shard i.
struct SlurmArray {
  std::filesystem::path folder;  ///< absolute; the job runs here and writes logs/i-of-n.txt
  std::size_t shards = 1;
  unsigned cores = 1;                ///< of each task
  std::vector<std::string> options;  ///< of sbatch: "time=1:00:00"
  std::vector<std::string> command;  ///< what every task runs; --shard and --out follow
};

/// The script that sbatch takes.
/// Errors: InputError if an option is none of sbatch's form.
std::string job_script(const SlurmArray& array);

/// Tasks that wait or run, whichever job they belong to.
/// Errors: InputError if Slurm does not answer.
std::set<std::size_t> tasks_in_queue(const SlurmArray& array);

/// Writes job.sh and submits these tasks. Returns the job's number.
/// Errors: InputError if Slurm does not take it.
std::string submit(const SlurmArray& array, const std::vector<std::size_t>& tasks);

}  // namespace tankrig::app
