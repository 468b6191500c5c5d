// `tankrig bench`: a benchmark file on the simulated rig, resumable, in shards, on all cores.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/tankrig/bench/bench_merge.hpp"
#include "apps/tankrig/bench/bench_results.hpp"
#include "apps/tankrig/bench/bench_run.hpp"
#include "apps/tankrig/bench/bench_slurm.hpp"
#include "apps/tankrig/bench/external_cloud.hpp"
#include "apps/tankrig/bench/live_plots.hpp"
#include "apps/tankrig/bench/run_cost.hpp"
#include "apps/tankrig/bench/shards.hpp"
#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "bench/benchmark/point_store.hpp"
#include "bench/external/limited_run.hpp"
#include "bench/sweep/point_views.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

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
  std::size_t slurm = 0;  ///< shards of a job array; 0: no job array
  std::vector<std::string> sbatch;
  bool dry_run = false, json = false;
};

double elapsed_s(Clock_::time_point begin) { return std::chrono::duration<double>(Clock_::now() - begin).count(); }

std::string in_words(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", seconds);
  if (seconds < 5400) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

fs::path out_folder(const BenchOptions& options) {
  if (!options.out.empty()) return options.out;
  return fs::path("benchmarks") / (options.file.stem().string() + (options.slurm > 0 ? "-shards" : ""));
}

unsigned jobs_of(const BenchOptions& options) {
  if (options.jobs > 0) return options.jobs;
  return options.slurm > 0 ? 1 : std::max(1U, std::thread::hardware_concurrency());
}

SlurmArray slurm_array(const BenchOptions& options) {
  fs::path folder = fs::absolute(out_folder(options)).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  SlurmArray array{folder, options.slurm, jobs_of(options), options.sbatch, {}};
  array.command = {fs::read_symlink("/proc/self/exe"), "bench", fs::absolute(options.file), "--rig",
                   find_rig(options.rig)};
  if (!options.preset.empty()) array.command.insert(array.command.end(), {"--preset", options.preset});
  if (options.world.sensor) array.command.insert(array.command.end(), {"--sensor", *options.world.sensor});
  for (const std::string& word :
       {std::string("--seed"), std::to_string(options.world.seed), std::string("--jobs"), std::to_string(array.cores)})
    array.command.push_back(word);
  return array;
}

/// Runs what is left of [begin, end) on `jobs` threads, each a configuration at a time.
class Sweep {
 public:
  Sweep(BenchRun& run, const fs::path& folder, PointStore& store, Progress& progress, std::size_t begin,
        std::size_t end)
      : run_(run), folder_(folder), store_(store), progress_(progress), next_(begin), end_(end) {
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
          const Evaluated evaluated = run_.evaluate(job->first, *job->second);
          if (!evaluated.row.is_null()) finish(job->first, evaluated);
        });
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      end_ = next_;
    }
  }

  /// The next configuration with its scan. A scan that fails is its configurations' result.
  std::optional<std::pair<std::size_t, std::shared_ptr<const MeasuredScan>>> take() {
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

  void finish(std::size_t point, const Evaluated& evaluated) {
    const std::lock_guard lock(mutex_);
    if (!evaluated.views.empty()) add_views(folder_, point, evaluated.views);
    store_.add(point, evaluated.row);
    plots_.tell(store_.rows());
    --left_;
    const std::size_t done = total_ - left_;
    const double to_go = elapsed_s(began_) / static_cast<double>(done) * static_cast<double>(left_);
    if (left_ > 0 && elapsed_s(told_) < 5) return;
    told_ = Clock_::now();
    progress_.update(fmt::format("bench: {} of {}, {} left", done, total_, in_words(to_go)),
                     static_cast<double>(done) / static_cast<double>(total_));
  }

  BenchRun& run_;
  const fs::path folder_;
  PointStore& store_;
  Progress& progress_;
  std::mutex mutex_;  // guards what follows, and the store's rows
  LivePlots plots_{run_.benchmark()};
  std::size_t next_, end_, left_ = 0, total_ = 0;
  const Clock_::time_point began_ = Clock_::now();
  Clock_::time_point told_{};
  std::exception_ptr failure_;
};

/// What making the run, and with it its first scan, has cost.
struct FirstScan {
  double wall_s = 0, cpu_s = 0;
};

/// Scans that the configurations of a shard need: the first configuration's, which every run makes, and one for each
/// change.
std::size_t scans_of(const BenchRun& run, const Shard& shard) {
  std::size_t scans = 1;
  std::string key = run.condition(0).scan_key();
  for (std::size_t point = shard.begin(run.benchmark().points()); point < shard.end(run.benchmark().points()); ++point)
    if (std::string other = run.condition(point).scan_key(); other != key) ++scans, key = std::move(other);
  return scans;
}

/// What the configurations will cost: a scan and a configuration are timed. Of a job array: until its longest task ends,
/// if all run at a time.
int tell_cost(BenchRun& run, const BenchOptions& options, const FirstScan& first) {
  const std::size_t all = run.benchmark().points();
  const unsigned jobs = jobs_of(options);
  const auto scan = run.scan(run.condition(0));
  const Clock_::time_point began = Clock_::now();
  const double cpu_before = processor_s();
  tbb::task_arena one_core(1);
  one_core.execute([&] { (void)run.evaluate(0, *scan); });
  const double point_s = elapsed_s(began), point_cpu_s = processor_s() - cpu_before;
  std::vector<Shard> shards;
  if (options.slurm == 0) shards.push_back(read_shard(options.shard));
  for (std::size_t i = 1; i <= options.slurm; ++i) shards.push_back({i, options.slurm});
  std::size_t points = 0, scans = 0;
  double longest_s = 0;
  for (const Shard& shard : shards) {
    const std::size_t its_scans = scans_of(run, shard);
    points += shard.size(all), scans += its_scans;
    longest_s = std::max(longest_s, static_cast<double>(shard.size(all)) * point_s / jobs +
                                        static_cast<double>(its_scans) * first.wall_s);
  }
  const double cpu_s = static_cast<double>(points) * point_cpu_s + static_cast<double>(scans) * first.cpu_s;
  const std::string script = options.slurm > 0 ? job_script(slurm_array(options)) : "";
  if (options.json) {
    ordered_json told{{"points", points},
                      {"scans", scans},
                      {"scan_s", first.wall_s},
                      {"point_s", point_s},
                      {"jobs", jobs},
                      {"expected_s", longest_s},
                      {"scan_cpu_s", first.cpu_s},
                      {"point_cpu_s", point_cpu_s},
                      {"expected_cpu_s", cpu_s},
                      {"left_out", run.refusals()}};
    if (options.slurm > 0) told.update({{"shards", shards.size()}, {"script", script}});
    print_json(told);
  } else {
    std::printf(
        "%zu configurations from %zu scans; one took %.1f s, a scan %.1f s: about %s with %zu x %u jobs, %s of "
        "processor time\n",
        points, scans, point_s, first.wall_s, in_words(longest_s).c_str(), shards.size(), jobs,
        in_words(cpu_s).c_str());
    std::printf("%s", script.c_str());
  }
  return kOk;
}

int bench(const BenchOptions& options) {
  const StopOnSignal stop_on_signal;
  Progress progress;
  Benchmark benchmark = read_benchmark(options.file);
  for (const std::string& warning : benchmark.warnings) progress.warn(warning);
  const Shard shard = read_shard(options.shard);
  const unsigned jobs = jobs_of(options);
  const tbb::global_control cores(tbb::global_control::max_allowed_parallelism, jobs);
  const Clock_::time_point began = Clock_::now();
  const double cpu_before = processor_s();
  BenchRun run(std::move(benchmark), load_rig(find_rig(options.rig), options.preset), options.world, progress);
  const FirstScan first{elapsed_s(began), processor_s() - cpu_before};
  progress.finish_line();
  for (const std::string& refusal : run.refusals()) progress.warn(refusal);
  for (const std::string& program : run.programs()) progress.note("runs " + program);
  if (options.dry_run) return tell_cost(run, options, first);
  if (options.slurm > 0) return bench_on_slurm(run, slurm_array(options), options.file, options.json, progress);

  const std::size_t points = run.benchmark().points();
  const fs::path folder = out_folder(options);
  PointStore store(folder, run.identity());
  keep_benchmark(folder, options.file);
  if (store.reused() > 0)
    progress.note(fmt::format("{} configurations of {} reused from {}", store.reused(), points, folder.string()));
  const Clock_::time_point swept = Clock_::now();
  const double cpu_at_sweep = processor_s();
  Sweep(run, folder, store, progress, shard.begin(points), shard.end(points))(jobs);
  const double sweep_cpu_s = processor_s() - cpu_at_sweep;
  progress.finish_line();
  if (!StopOnSignal::requested() && shard.index == 1) run.write_pictures(folder);
  const std::size_t failed = write_results(folder, run.benchmark(), store.rows());
  LivePlots(run.benchmark()).tell(store.rows(), true);
  Feed::one().report(folder / "report.html");
  const std::size_t missing = shard.missing(store.rows(), points);
  if (missing > 0)
    progress.warn(fmt::format("stopped: {} configurations are missing; the same command goes on", missing));
  if (failed > 0)
    progress.warn(fmt::format("{} configurations failed: column `error` of results.csv says why", failed));
  const double took = elapsed_s(swept);
  const std::size_t done = store.rows().size() - store.reused();
  if (options.json)
    print_json({{"folder", folder.string()},
                {"points", shard.size(points)},
                {"reused", store.reused()},
                {"missing", missing},
                {"failed", failed},
                {"jobs", jobs},
                {"wall_s", took},
                {"first_scan_cpu_s", first.cpu_s},
                {"sweep_cpu_s", sweep_cpu_s},
                {"points_bytes", store.bytes()},
                {"peak_mib", peak_mib()},
                {"left_out", run.refusals()}});
  else
    std::printf("%zu configurations in %.1f s with %u jobs (%zu reused): look at %s\n", done, took, jobs,
                store.reused(), printable((folder / "report.html").string()).c_str());
  if (!options.json && done > 0)
    std::printf(
        "processor time: %.1f s for the first scan, %.2f s for each configuration; at most %.0f MiB of memory; "
        "%.1f kB on disk for each configuration\n",
        first.cpu_s, sweep_cpu_s / static_cast<double>(done), peak_mib(),
        static_cast<double>(store.bytes()) / 1000 / static_cast<double>(store.rows().size()));
  return missing > 0 || failed > 0 ? kPartial : kOk;
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
  c->add_option("--sensor", o.world.sensor, "Simulated sensor model")->check(CLI::IsMember(kSensors));
  c->add_option("--seed", o.world.seed, "Seed of the first iteration")->capture_default_str();
  c->add_option("--jobs", o.jobs,
                "Cores, and configurations at a time; the results do not depend on it (default: all; of a task: 1)")
      ->check(CLI::Range(1, 4096));
  CLI::Option* shard =
      c->add_option("--shard", o.shard, "i/n: the i-th of n parts of the configurations")->capture_default_str();
  CLI::Option* slurm =
      c->add_option("--slurm", o.slurm,
                    "Submit a Slurm job array of so many shards, one a task; again: those that are lost")
          ->check(CLI::Range(std::size_t{1}, kMostShards))
          ->excludes(shard);
  c->add_option("--sbatch", o.sbatch, "With --slurm: an option of sbatch, like time=2:00:00 or partition=long")
      ->allow_extra_args(false)
      ->needs(slurm);
  c->add_option(
      "--out", o.out,
      "Folder of the results; one of the same run goes on (default: benchmarks/NAME, with --slurm NAME-shards)");
  c->add_flag("--dry-run", o.dry_run, "Say what is left out, and the cost: one scan and one configuration are timed");
  add_json_flag(c, o.json);

  // What BenchRun calls for an <algorithm>; not for people.
  CLI::App* p = c->add_subcommand(kProgramCommand, "Run a program under limits (started by bench itself)")->group("");
  p->footer("Example: tankrig bench program FOLDER");
  ProgramOptions& po = options_of(p, chosen, &run_program);
  p->add_option("folder", po.folder, "Where run.json says what is run")->required()->check(CLI::ExistingDirectory);

  add_bench_merge(c, chosen);
}

}  // namespace tankrig::app
