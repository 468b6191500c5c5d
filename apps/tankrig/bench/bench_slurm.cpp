#include "apps/tankrig/bench/bench_slurm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/bench/bench_results.hpp"
#include "apps/tankrig/bench/shards.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "bench/benchmark/point_store.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig::app {

int bench_on_slurm(const BenchRun& run, const SlurmArray& array, const fs::path& file, bool json, Progress& progress) {
  const std::size_t points = run.benchmark().points();
  if (array.shards > points)
    throw InputError(
        fmt::format("--slurm: found {} shards, expected at most {}, a configuration in each", array.shards, points));
  (void)job_script(array);  // refuses a bad option before anything is written
  const std::set<std::size_t> queue = tasks_in_queue(array);
  std::size_t whole = 0, waiting = 0;
  std::vector<std::size_t> tasks;
  for (std::size_t i = 1; i <= array.shards; ++i) {
    const Shard shard{i, array.shards};
    const fs::path folder = shard.folder_in(array.folder);
    std::size_t missing = shard.size(points);
    const bool is_new = !holds_benchmark(folder);
    if (is_new) {
      const PointStore made(folder, run.identity());
    } else {
      const PointRows rows(folder);
      check_run(folder, rows.run(), run.identity());
      missing = shard.missing(rows, points);
    }
    if (missing == 0) {
      ++whole;
    } else if (queue.contains(i)) {
      ++waiting;
    } else {
      tasks.push_back(i);
      if (!is_new)
        progress.warn(fmt::format("shard {} is lost: {} of its {} configurations are missing; its task said: {}",
                                  shard.name(), missing, shard.size(points), shard.log_in(array.folder).string()));
    }
  }
  const std::string job = tasks.empty() ? "" : submit(array, tasks);
  const std::string next =
      fmt::format("tankrig bench merge {} {}/*-of-{} --out FOLDER", file.string(), array.folder.string(), array.shards);
  if (json) {
    ordered_json told{{"folder", array.folder.string()},
                      {"points", points},
                      {"shards", array.shards},
                      {"whole", whole},
                      {"waiting", waiting},
                      {"submitted", tasks},
                      {"job", job.empty() ? ordered_json() : ordered_json(job)},
                      {"left_out", run.refusals()}};
    print_json(told);
    return kOk;
  }
  if (!job.empty())
    std::printf("job %s: %zu shards of %zu submitted\n", printable(job).c_str(), tasks.size(), array.shards);
  if (waiting > 0) std::printf("%zu shards wait or run: squeue --me\n", waiting);
  std::printf("%s: %s\n", whole == array.shards ? "all shards are whole" : "when all have ended",
              printable(next).c_str());
  return kOk;
}

}  // namespace tankrig::app
