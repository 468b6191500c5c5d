#include "apps/tankrig/bench/bench_merge.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/bench/bench_results.hpp"
#include "apps/tankrig/bench/run_cost.hpp"
#include "apps/tankrig/bench/shards.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "bench/benchmark/point_store.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig::app {
namespace {

struct MergeOptions {
  fs::path file, out;
  std::vector<fs::path> folders;
  bool json = false;
};

/// A folder that a job array named after its shard, without all of it.
struct LostShard {
  Shard shard;
  std::size_t missing;
};

int merge(const MergeOptions& options) {
  Benchmark benchmark = read_benchmark(options.file);
  std::vector<PointRows> shards;
  for (const fs::path& folder : options.folders) {
    shards.emplace_back(folder);
    if (shards.back().run() != shards.front().run())
      throw InputError(folder, "is of another run than " + options.folders.front().string());
  }
  const ordered_json& run = shards.front().run();
  if (run["benchmark_sha256"] != ordered_json(sha256_of_text(read_whole_file(options.file))))
    throw InputError(options.file, "is not the benchmark that was run, expected the file with the SHA-256 " +
                                       run["benchmark_sha256"].dump());
  drop_loops_left_out(benchmark, run);
  PointStore store(options.out, run);
  keep_benchmark(options.out, options.file);
  for (const PointRows& shard : shards) store.add(shard);
  for (const fs::path& folder : options.folders) take_pictures(options.out, folder, benchmark);
  write_results(options.out, benchmark, store.rows());

  std::vector<std::size_t> missing;
  for (std::size_t point = 0; point < benchmark.points(); ++point)
    if (!store.rows().contains(point)) missing.push_back(point);
  std::vector<LostShard> lost;
  for (const fs::path& folder : options.folders)
    if (const auto shard = shard_of_folder(folder))
      if (const std::size_t lacks = shard->missing(store.rows(), benchmark.points()); lacks > 0)
        lost.push_back({*shard, lacks});
  if (options.json) {
    ordered_json names = ordered_json::array();
    for (const LostShard& l : lost) names.push_back(l.shard.name());
    print_json({{"folder", options.out.string()},
                {"points", store.rows().size()},
                {"missing", missing},
                {"lost", names},
                {"cpu_s", processor_s()},
                {"peak_mib", peak_mib()}});
  } else {
    std::printf("%zu configurations of %zu: %s\n", store.rows().size(), benchmark.points(),
                printable((options.out / "results.csv").string()).c_str());
  }
  if (missing.empty()) return kOk;
  for (const LostShard& l : lost)
    std::fprintf(stderr, "tankrig: shard %s is lost: %zu of its %zu configurations are missing\n",
                 l.shard.name().c_str(), l.missing, l.shard.size(benchmark.points()));
  std::fprintf(stderr, "tankrig: %zu configurations are missing, the first is %zu: %s\n", missing.size(),
               missing.front(),
               lost.empty() ? "run their shard again" : "the same tankrig bench --slurm submits lost shards alone");
  return kPartial;
}

}  // namespace

void add_bench_merge(CLI::App* bench, ChosenCommand& chosen) {
  CLI::App* m = bench->add_subcommand("merge", "Bring the results of shards together");
  MergeOptions& mo = options_of(m, chosen, &merge);
  m->footer(
      "Exit codes: 0 done; 1 failed; 2 wrong command line; 3 in part: configurations are missing.\n"
      "Example: tankrig bench merge etc/benchmarks/paper-figures-8-9.xml shard1 shard2 --out paper");
  m->add_option("file", mo.file, "The benchmark file")->required()->check(CLI::ExistingFile);
  m->add_option("folders", mo.folders, "Folders of the shards")->required();
  m->add_option("--out", mo.out, "Folder of the merged results")->required();
  add_json_flag(m, mo.json);
}

}  // namespace tankrig::app
