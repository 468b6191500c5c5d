#include "apps/tankrig/bench/slurm.hpp"

#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr const char* kScript = "job.sh";
constexpr int kNoSuchProgram = 127;  // of a shell

/// One word for a shell, whatever is in it.
std::string shell_quoted(const std::string& word) {
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// Of the folder and the number of shards: what Slurm knows it by, whenever it was submitted.
std::string job_name(const SlurmArray& array) {
  return fmt::format("tankrig-{}-{}", sha256_of_text(array.folder.string()).substr(0, 12), array.shards);
}

/// What a program of Slurm's prints; what it says of errors goes to standard error.
std::string answer_of(const std::string& program, const std::string& command) {
  FILE* const pipe = ::popen(command.c_str(), "re");
  if (!pipe) throw InputError(program + " cannot be started: " + std::strerror(errno));
  std::string out;
  char part[4096];
  while (const std::size_t got = std::fread(part, 1, sizeof part, pipe)) out.append(part, got);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNoSuchProgram)
    throw InputError(program + " is not here, expected Slurm's own programs (Debian package slurm-client)");
  if (status != 0)
    throw InputError(program + (WIFEXITED(status) ? fmt::format(" ended with exit code {}", WEXITSTATUS(status))
                                                  : std::string(" was killed")));
  return out;
}

void check_option(const std::string& option) {
  const std::size_t name = option.find_first_not_of("abcdefghijklmnopqrstuvwxyz-");
  if (option.empty() || option.front() == '-' || name == 0 || (name != std::string::npos && option[name] != '=') ||
      option.find_first_of("\t\r\n") != std::string::npos || find_unprintable(option) != std::string::npos)
    throw InputError("--sbatch: found '" + shown_text(option) +
                     "', expected an option of sbatch without its dashes, like time=2:00:00");
}

/// "1-3,7": as sbatch takes an array.
std::string in_ranges(const std::vector<std::size_t>& tasks) {
  std::string out;
  for (std::size_t i = 0, next; i < tasks.size(); i = next) {
    next = i + 1;
    while (next < tasks.size() && tasks[next] == tasks[next - 1] + 1) ++next;
    out += fmt::format("{}{}", i > 0 ? "," : "", tasks[i]);
    if (next > i + 1) out += fmt::format("-{}", tasks[next - 1]);
  }
  return out;
}

}  // namespace

std::string job_script(const SlurmArray& array) {
  std::string out = fmt::format(
      "#!/bin/sh\n"
      "#SBATCH --job-name={}\n"
      "#SBATCH --output=logs/%a-of-{}.txt\n"
      "#SBATCH --cpus-per-task={}\n",
      job_name(array), array.shards, array.cores);
  for (const std::string& option : array.options) {
    check_option(option);
    out += "#SBATCH --" + option + "\n";
  }
  out += "exec";
  for (const std::string& word : array.command) out += " " + shell_quoted(word);
  return out + fmt::format(" --shard \"$SLURM_ARRAY_TASK_ID/{0}\" --out {1}/\"$SLURM_ARRAY_TASK_ID-of-{0}\"\n",
                           array.shards, shell_quoted(array.folder.string()));
}

std::set<std::size_t> tasks_in_queue(const SlurmArray& array) {
  std::istringstream lines(answer_of("squeue", "squeue --noheader --array --me --format=%K --name=" + job_name(array)));
  std::set<std::size_t> out;
  for (std::string line; std::getline(lines, line);) {
    std::size_t task = 0;
    if (!parse_number(line, task))
      throw InputError("squeue: found '" + shown_text(line) + "', expected the number of a task of a job array");
    out.insert(task);
  }
  return out;
}

std::string submit(const SlurmArray& array, const std::vector<std::size_t>& tasks) {
  fs::create_directories(array.folder / "logs");
  write_whole_file(array.folder / kScript, job_script(array));
  const std::string answer =
      answer_of("sbatch", fmt::format("cd {} && exec sbatch --parsable --array={} {}",
                                      shell_quoted(array.folder.string()), in_ranges(tasks), kScript));
  return answer.substr(0, answer.find_first_of(";\n"));  // "12;cluster"
}

}  // namespace tankrig::app
