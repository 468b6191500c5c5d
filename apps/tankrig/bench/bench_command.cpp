// `tankrig bench`: a benchmark file on the simulated rig, resumable, in shards, on all cores.
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/tankrig/bench/bench_results.hpp"
#include "apps/tankrig/bench/bench_run.hpp"
#include "apps/tankrig/bench/external_cloud.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "bench/benchmark/point_store.hpp"
#include "bench/external/limited_run.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig::app {
namespace {

using Clock_ = std::chrono::steady_clock;

struct BenchOptions {
  fs::path file, out;
  std::string rig = "tank-sim", preset, shard = "1/1";
  sim::WorldOptions world;
  unsigned jobs = 0;
  bool dry_run = false, json = false;
};

struct MergeOptions {
  fs::path file, out;
  std::vector<fs::path> folders;
  bool json = false;
};

double elapsed_s(Clock_::time_point begin) { return std::chrono::duration<double>(Clock_::now() - begin).count(); }

std::string in_words(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", seconds);
  if (seconds < 5400) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

/// "2/4": the second quarter of the configurations, in their order.
std::pair<std::size_t, std::size_t> shard_of(const std::string& text, std::size_t points) {
  std::size_t index = 0, count = 0;
  const auto slash = text.find('/');
  if (slash == std::string::npos || !parse_number(std::string_view(text).substr(0, slash), index) ||
      !parse_number(std::string_view(text).substr(slash + 1), count) || index < 1 || index > count || count > 100'000)
    throw InputError("--shard: found '" + shown_text(text) + "', expected i/n, 1/1 to n/n");
  return {points * (index - 1) / count, points * index / count};
}

fs::path default_folder(const fs::path& file) { return fs::path("benchmarks") / file.stem(); }

/// Runs what is left of [begin, end) on `jobs` threads, each a configuration at a time.
class Sweep {
 public:
  Sweep(BenchRun& run, PointStore& store, Progress& progress, std::size_t begin, std::size_t end)
      : run_(run), store_(store), progress_(progress), next_(begin), end_(end) {
    for (std::size_t point = begin; point < end; ++point) left_ += !store.rows().contains(point);
    total_ = left_;
  }

  void operator()(unsigned jobs) {
    std::vector<std::thread> workers;
    for (unsigned i = 0; i < jobs; ++i) workers.emplace_back([this] { work(); });
    for (std::thread& worker : workers) worker.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void work() {
    tbb::task_arena one_core(1);
    try {
      while (const auto job = take())
        one_core.execute([&] {
          ordered_json row = run_.evaluate(job->first, *job->second);
          if (!row.is_null()) finish(job->first, std::move(row));
        });
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      end_ = next_;
    }
  }

  /// The next configuration with its scan. A scan that fails is its configurations' result.
  std::optional<std::pair<std::size_t, std::shared_ptr<const LayeredScan>>> take() {
    const std::lock_guard lock(mutex_);
    for (; next_ < end_ && !StopOnSignal::requested(); ++next_) {
      if (store_.rows().contains(next_)) continue;
      const std::size_t point = next_;
      try {
        auto scan = run_.scan(run_.condition(point));
        ++next_;
        return std::pair(point, std::move(scan));
      } catch (const InputError& e) {
        if (StopOnSignal::requested()) return std::nullopt;
        store_.add(point, {{"values", run_.benchmark().values(point)}, {"error", printable(e.what())}});
        --left_;
      }
    }
    return std::nullopt;
  }

  void finish(std::size_t point, ordered_json row) {
    const std::lock_guard lock(mutex_);
    store_.add(point, std::move(row));
    --left_;
    const std::size_t done = total_ - left_;
    const double to_go = elapsed_s(began_) / static_cast<double>(done) * static_cast<double>(left_);
    if (left_ > 0 && elapsed_s(told_) < 5) return;
    told_ = Clock_::now();
    progress_.update(fmt::format("bench: {} of {}, {} left", done, total_, in_words(to_go)),
                     static_cast<double>(done) / static_cast<double>(total_));
  }

  BenchRun& run_;
  PointStore& store_;
  Progress& progress_;
  std::mutex mutex_;  // guards what follows, and the store's rows
  std::size_t next_, end_, left_ = 0, total_ = 0;
  const Clock_::time_point began_ = Clock_::now();
  Clock_::time_point told_{};
  std::exception_ptr failure_;
};

/// What the configurations from `begin` to `end` will cost: a scan and a configuration are timed.
int tell_cost(BenchRun& run, const BenchOptions& options, std::size_t begin, std::size_t end, unsigned jobs,
              double first_scan_s) {
  std::size_t scans = 0;
  std::string key;
  for (std::size_t point = begin; point < end; ++point)
    if (const std::string other = run.condition(point).scan_key(); other != key || point == begin) ++scans, key = other;
  const auto scan = run.scan(run.condition(0));
  const Clock_::time_point began = Clock_::now();
  tbb::task_arena one_core(1);
  one_core.execute([&] { (void)run.evaluate(0, *scan); });
  const double point_s = elapsed_s(began);
  const double total = static_cast<double>(end - begin) * point_s / jobs + static_cast<double>(scans) * first_scan_s;
  if (options.json) {
    print_json({{"points", end - begin},
                {"scans", scans},
                {"scan_s", first_scan_s},
                {"point_s", point_s},
                {"jobs", jobs},
                {"expected_s", total},
                {"left_out", run.refusals()}});
  } else {
    std::printf("%zu configurations from %zu scans; one took %.1f s, a scan %.1f s: about %s with %u jobs\n",
                end - begin, scans, point_s, first_scan_s, in_words(total).c_str(), jobs);
  }
  return kOk;
}

int bench(const BenchOptions& options) {
  const StopOnSignal stop_on_signal;
  Progress progress;
  Benchmark benchmark = read_benchmark(options.file);
  for (const std::string& warning : benchmark.warnings) progress.warn(warning);
  const unsigned jobs = options.jobs ? options.jobs : std::max(1U, std::thread::hardware_concurrency());
  const Clock_::time_point began = Clock_::now();
  BenchRun run(std::move(benchmark), load_rig(find_rig(options.rig), options.preset), options.world, progress);
  const double first_scan_s = elapsed_s(began);
  progress.finish_line();
  for (const std::string& refusal : run.refusals()) progress.warn(refusal);
  for (const std::string& program : run.programs()) progress.note("runs " + program);
  const auto [begin, end] = shard_of(options.shard, run.benchmark().points());
  if (options.dry_run) return tell_cost(run, options, begin, end, jobs, first_scan_s);

  const fs::path folder = options.out.empty() ? default_folder(options.file) : options.out;
  PointStore store(folder, run.identity());
  keep_benchmark(folder, options.file);
  if (store.reused() > 0)
    progress.note(fmt::format("{} configurations of {} reused from {}", store.reused(), run.benchmark().points(),
                              folder.string()));
  const Clock_::time_point swept = Clock_::now();
  Sweep(run, store, progress, begin, end)(jobs);
  progress.finish_line();
  if (!StopOnSignal::requested()) run.write_pictures(folder);
  write_results(folder, run.benchmark(), run.identity(), store.rows());
  std::size_t missing = 0;
  for (std::size_t point = begin; point < end; ++point) missing += !store.rows().contains(point);
  const std::size_t failed = failed_points(store.rows());
  if (missing > 0)
    progress.warn(fmt::format("stopped: {} configurations are missing; the same command goes on", missing));
  if (failed > 0)
    progress.warn(fmt::format("{} configurations failed: column `error` of results.csv says why", failed));
  const double took = elapsed_s(swept);
  const std::size_t done = store.rows().size() - store.reused();
  if (options.json)
    print_json({{"folder", folder.string()},
                {"points", end - begin},
                {"reused", store.reused()},
                {"missing", missing},
                {"failed", failed},
                {"jobs", jobs},
                {"wall_s", took},
                {"left_out", run.refusals()}});
  else
    std::printf("%zu configurations in %.1f s with %u jobs (%zu reused): look at %s\n", done, took, jobs,
                store.reused(), printable((folder / "report.html").string()).c_str());
  return missing > 0 || failed > 0 ? kPartial : kOk;
}

int merge(const MergeOptions& options) {
  Benchmark benchmark = read_benchmark(options.file);
  ordered_json run;
  PointRows rows;
  for (const fs::path& folder : options.folders) {
    auto [its_run, its_rows] = read_points(folder);
    if (run.is_null()) run = its_run;
    if (its_run != run) throw InputError(folder, "is of another run than " + options.folders.front().string());
    rows.insert(its_rows.begin(), its_rows.end());
  }
  if (run["benchmark_sha256"] != ordered_json(sha256_of_text(read_whole_file(options.file))))
    throw InputError(options.file, "is not the benchmark that was run, expected the file with the SHA-256 " +
                                       run["benchmark_sha256"].dump());
  drop_loops_left_out(benchmark, run);
  PointStore store(options.out, run);
  keep_benchmark(options.out, options.file);
  for (const auto& [point, row] : rows)
    if (!store.rows().contains(point)) store.add(point, row);
  write_results(options.out, benchmark, run, store.rows());
  std::vector<std::size_t> missing;
  for (std::size_t point = 0; point < benchmark.points(); ++point)
    if (!store.rows().contains(point)) missing.push_back(point);
  if (options.json)
    print_json({{"folder", options.out.string()}, {"points", store.rows().size()}, {"missing", missing}});
  else
    std::printf("%zu configurations of %zu: %s\n", store.rows().size(), benchmark.points(),
                printable((options.out / "results.csv").string()).c_str());
  if (missing.empty()) return kOk;
  std::fprintf(stderr, "tankrig: %zu configurations are missing, the first is %zu: run their shard again\n",
               missing.size(), missing.front());
  return kPartial;
}

struct ProgramOptions {
  fs::path folder;
};

int run_program(const ProgramOptions& options) {
  supervise_for_caller(options.folder);
  return kOk;
}

}  // namespace

void add_bench(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("bench", "Run a benchmark file on the simulated rig: sweep its conditions, measure");
  c->require_subcommand(0, 1);
  const auto options = std::make_shared<BenchOptions>();
  c->callback([c, options, &chosen] {
    if (!c->get_subcommands().empty()) return;
    if (options->file.empty()) throw CLI::RequiredError("file");
    chosen = [options] { return bench(*options); };
  });
  BenchOptions& o = *options;
  c->footer(
      "Exit codes: 0 done; 1 failed; 2 wrong command line; 3 in part: stopped, or configurations failed.\n"
      "Example: tankrig bench etc/benchmarks/paper-figures-8-9.xml --out benchmarks/paper");
  c->add_option("file", o.file, "Benchmark file, XML (docs/reference/benchmark.md)")->check(CLI::ExistingFile);
  add_rig_option(c, o.rig);
  c->add_option("--preset", o.preset, "Preset of the rig file");
  c->add_option("--sensor", o.world.sensor, "Simulated sensor model")->check(CLI::IsMember({"gaussian", "emva1288"}));
  c->add_option("--seed", o.world.seed, "Seed of the first iteration")->capture_default_str();
  c->add_option("--jobs", o.jobs, "Configurations at a time; the results do not depend on it (default: all cores)")
      ->check(CLI::Range(1, 4096));
  c->add_option("--shard", o.shard, "i/n: the i-th of n parts of the configurations")->capture_default_str();
  c->add_option("--out", o.out, "Folder of the results; one of the same run goes on (default: benchmarks/NAME)");
  c->add_flag("--dry-run", o.dry_run, "Say what is left out, and the cost: one scan and one configuration are timed");
  add_json_flag(c, o.json);

  // What BenchRun calls for an <algorithm>; not for people.
  CLI::App* p = c->add_subcommand(kProgramCommand, "Run a program under limits (started by bench itself)")->group("");
  p->footer("Example: tankrig bench program FOLDER");
  ProgramOptions& po = options_of(p, chosen, &run_program);
  p->add_option("folder", po.folder, "Where run.json says what is run")->required()->check(CLI::ExistingDirectory);

  CLI::App* m = c->add_subcommand("merge", "Bring the results of shards together");
  MergeOptions& mo = options_of(m, chosen, &merge);
  m->footer("Example: tankrig bench merge etc/benchmarks/paper-figures-8-9.xml shard1 shard2 --out paper");
  m->add_option("file", mo.file, "The benchmark file")->required()->check(CLI::ExistingFile);
  m->add_option("folders", mo.folders, "Folders of the shards")->required();
  m->add_option("--out", mo.out, "Folder of the merged results")->required();
  add_json_flag(m, mo.json);
}

}  // namespace tankrig::app
