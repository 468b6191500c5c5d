// `tankrig experiment`: a benchmark file whose light levels are recorded one by one, on a real rig or a simulated one.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/bench/bench_results.hpp"
#include "apps/tankrig/bench/evaluation.hpp"
#include "apps/tankrig/bench/live_plots.hpp"
#include "apps/tankrig/bench/scan_trace.hpp"
#include "apps/tankrig/bench/session_scan.hpp"
#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "apps/tankrig/experiment/experiment_figures.hpp"
#include "apps/tankrig/experiment/light_operator.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "apps/tankrig/scan/recorded_session.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "bench/sweep/sweep_report.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "pipeline/report_session.hpp"
#include "rig/scan/session_rig.hpp"
#include "session/checking/sha256.hpp"
#include "session/reading/session_yaml.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig::app {
namespace {

struct ExperimentOptions {
  fs::path file, out;
  ScanOptions scan;
  std::optional<double> again;  ///< this level once more [lx]
};

/// What is recorded for one configuration.
struct Recipe {
  std::string session;  ///< its folder's name: "147lx", "147lx-2" in the second iteration
  std::string caption;
  std::optional<LuxLevel> level;
  std::uint64_t iteration = 0;
};

Recipe recipe_of(const Benchmark& benchmark, std::size_t point) {
  Recipe recipe{"scan", "scan", {}, 0};
  const std::vector<double> values = benchmark.values(point);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Updater& updater = benchmark.updaters[i];
    if (updater.kind == UpdaterKind::kRepeat) recipe.iteration = static_cast<std::uint64_t>(values[i]);
    if (updater.kind != UpdaterKind::kLux) continue;
    recipe.level = {values[i], updater.tolerance};
    recipe.session = fmt::format("{:g}lx", values[i]), recipe.caption = fmt::format("{:g} lx", values[i]);
  }
  if (recipe.iteration > 0) recipe.session += fmt::format("-{}", recipe.iteration + 1);
  return recipe;
}

/// Why people cannot change it between two recordings; empty: they can, or it is a matter of evaluation.
std::string not_by_hand(const Updater& updater) {
  switch (updater.kind) {
    case UpdaterKind::kNone:
    case UpdaterKind::kRepeat:
    case UpdaterKind::kAlgorithm:
    case UpdaterKind::kLux:
      return "";
    default:
      return "an experiment changes the light alone, by luxUpdater: tankrig bench does this on a simulated rig";
  }
}

/// What the recordings depend on, as it is typed, beyond what every benchmark is told by.
std::string further_options(const ScanOptions& scan) {
  sim::WorldOptions world = scan.world;
  world.sensor.reset();
  std::vector<std::string> words = option_words(world);
  if (!scan.calibration.empty()) words.insert(words.begin(), {"--calibration", scan.calibration.filename().string()});
  return fmt::format("{}", fmt::join(words, " "));
}

class Experiment {
 public:
  Experiment(const ExperimentOptions& options, Progress& progress)
      : options_(options),
        progress_(progress),
        rig_(load_rig(find_rig(options.scan.rig), options.scan.preset, options.scan.calibration)),
        parameters_(pipeline_parameters(rig_.root)),
        light_(rig_, options_.scan.world, progress),
        evaluation_(checked(read_benchmark(options.file)), rig_, options.scan.world),
        folder_(options.out.empty() ? fs::path("experiments") / options.file.stem() : options.out) {
    for (const std::string& warning : calibration_warnings(rig_)) progress_.warn(warning);
    evaluation_.leave_out_loops([&](const Updater& updater) {
      const std::string why = not_by_hand(updater);
      return why.empty() ? evaluation_.unknown_name(updater) : why;
    });
    SessionInfo info;
    describe_for_recording(rig_, info);
    evaluation_.refuse_measures(
        trace_of_rig(rig_, info.cameras, rig_.scan.capture.read_lux ? std::optional(0.0) : std::nullopt));
    for (const std::string& refusal : evaluation_.refusals()) progress_.warn(refusal);
    for (const std::string& program : evaluation_.programs()) progress_.note("runs " + program);
    check_options();
    evaluation_.identity()["command"] = "experiment";
    if (const std::string more = further_options(options_.scan); !more.empty()) evaluation_.identity()[kOptions] = more;
    evaluation_.identity()["calibration_sha256"] = sha256_of_text(calibration_yaml(info));
  }

  int run();

 private:
  const Benchmark& benchmark() const { return evaluation_.benchmark(); }
  Benchmark checked(Benchmark benchmark) {
    for (const std::string& warning : benchmark.warnings) progress_.warn(warning);
    return benchmark;
  }
  fs::path session_path(const Recipe& recipe) const { return folder_ / "sessions" / recipe.session; }
  void check_options() const;
  void set_aside_what_comes_again() const;
  /// Nothing if a stop was asked for.
  std::optional<OpenedSession> recorded(const Recipe& recipe);
  void report(const Session& session);
  /// `hash`: of its session.yaml.
  Evaluated measured(std::size_t point, const Recipe& recipe, OpenedSession opened, const std::string& hash);
  /// Returns how many failed.
  std::size_t write(const PointStore& store);
  int told(const PointStore& store, std::size_t failed);

  const ExperimentOptions options_;
  Progress& progress_;
  const RigConfig rig_;
  const PipelineParameters parameters_;
  const LightOperator light_;
  Evaluation evaluation_;
  const fs::path folder_;
};

void Experiment::check_options() const {
  bool levels = false, again = false;
  for (const Updater& updater : benchmark().updaters) {
    if (updater.kind != UpdaterKind::kLux) continue;
    levels = true;
    for (std::size_t i = 0; i < updater.count(); ++i) {
      light_.check({updater.value(i), updater.tolerance});
      again = again || updater.value(i) == options_.again;
    }
  }
  if (options_.again && !again)
    throw InputError(
        fmt::format("--again: found {:g}, expected a level of {}", *options_.again, options_.file.filename().string()));
  if (levels && options_.scan.world.light)
    throw InputError("--light: found it beside a file with light levels, expected one of them");
}

void Experiment::set_aside_what_comes_again() const {
  for (std::size_t point = 0; options_.again && point < benchmark().points(); ++point) {
    const Recipe recipe = recipe_of(benchmark(), point);
    if (recipe.level && recipe.level->lux == *options_.again && fs::exists(session_path(recipe)))
      put_aside(session_path(recipe), "earlier", progress_);
  }
}

std::optional<OpenedSession> Experiment::recorded(const Recipe& recipe) {
  try {
    return recorded_session(
        options_.scan, rig_, session_path(recipe),
        [this](const JointVector& posture) { return sweep_plan(rig_, posture); }, progress_,
        [&](ScanOptions& scan) {
          scan.world.seed += recipe.iteration;
          if (recipe.level) light_.set(*recipe.level, scan);
        });
  } catch (const std::exception& e) {
    if (!StopOnSignal::requested()) throw;
    progress_.warn(e.what());
    return std::nullopt;
  }
}

void Experiment::report(const Session& session) {
  if (fs::exists(session.path / "report.html")) return;
  OutsideView outside;
  std::optional<sim::TankWorld> tank;
  if (!rig_.scene.empty()) {
    sim::WorldOptions world = options_.scan.world;
    world.light = session.info.light;
    tank.emplace(load_world(rig_, world));
    outside = [&](const JointVector& q, bool laser_on) { return tank->render_external(q, laser_on, 1280, 860); };
  }
  reconstruct_and_report(session, parameters_, StopOnSignal::requested(), progress_.callback(), outside);
  progress_.finish_line();
}

Evaluated Experiment::measured(std::size_t point, const Recipe& recipe, OpenedSession opened, const std::string& hash) {
  const SessionInfo info = opened.session.info;
  Evaluated evaluated = evaluation_.evaluate(point, SessionScan(std::move(opened), rig_));
  ordered_json& row = evaluated.row;
  if (row.is_null()) return evaluated;
  const auto lux = mean_lux(info);
  row["session"] = (fs::path("sessions") / recipe.session).string();
  row["session_sha256"] = hash;
  row["recorded_utc"] = info.created_utc;
  if (lux) row["lux"] = *lux;
  if (info.lux_uncertainty) row["lux_uncertainty"] = *info.lux_uncertainty;
  if (recipe.level && lux && !recipe.level->holds(*lux)) {
    row["warning"] =
        fmt::format("the light was {:.1f} lx, expected {:g} +-{:.2g}", *lux, recipe.level->lux, recipe.level->margin());
    progress_.warn(recipe.session + ": " + row["warning"].get<std::string>());
  }
  return evaluated;
}

std::size_t Experiment::write(const PointStore& store) {
  std::vector<PicturedSession> sessions;
  for (std::size_t point = 0; point < benchmark().points(); ++point) {
    if (!store.rows().contains(point)) continue;
    const Recipe recipe = recipe_of(benchmark(), point);
    const fs::path path = session_path(recipe);
    const bool known = std::ranges::any_of(sessions, [&](const PicturedSession& s) { return s.path == path; });
    if (recipe.iteration == 0 && !known && fs::exists(path / "report.html")) sessions.push_back({recipe.caption, path});
  }
  std::vector<std::string> clouds;
  for (std::size_t i = 0; i < benchmark().measures.size(); ++i) {
    const std::string cloud = evaluation_.measured_cloud(i, evaluation_.condition(0));
    if (std::ranges::find(kMethods, cloud) != kMethods.end() && std::ranges::find(clouds, cloud) == clouds.end())
      clouds.push_back(cloud);
  }
  if (!sessions.empty()) write_experiment_figures(folder_, sessions, clouds);
  return write_results(folder_, benchmark(), store.rows());
}

int Experiment::run() {
  PointStore store(folder_, evaluation_.identity());
  LivePlots plots(benchmark());
  set_aside_what_comes_again();
  keep_benchmark(folder_, options_.file);
  for (std::size_t point = 0; point < benchmark().points(); ++point) {
    const Recipe recipe = recipe_of(benchmark(), point);
    progress_.note(fmt::format("{} of {}: {}", point + 1, benchmark().points(), recipe.session));
    std::optional<OpenedSession> opened = recorded(recipe);
    if (!opened) break;
    report(opened->session);
    const std::string hash = sha256_of_text(read_whole_file(opened->session.path / "session.yaml"));
    const bool known = store.rows().contains(point) && store.rows().row(point).value("session_sha256", "") == hash;
    if (!StopOnSignal::requested() && !known)
      if (const Evaluated evaluated = measured(point, recipe, std::move(*opened), hash); !evaluated.row.is_null()) {
        if (!evaluated.views.empty()) add_views(folder_, point, evaluated.views);
        store.add(point, evaluated.row);
        plots.tell(store.rows());
      }
    if (StopOnSignal::requested()) break;
  }
  const std::size_t failed = write(store);
  plots.tell(store.rows(), true);
  Feed::one().report(folder_ / "report.html");
  return told(store, failed);
}

int Experiment::told(const PointStore& store, std::size_t failed) {
  const std::size_t points = benchmark().points();
  std::size_t missing = 0;
  ordered_json levels = ordered_json::array();
  for (std::size_t point = 0; point < points; ++point) {
    if (!store.rows().contains(point) || !fs::exists(session_path(recipe_of(benchmark(), point)))) {
      ++missing;
      continue;
    }
    const ordered_json row = store.rows().row(point);
    ordered_json level{{"session", row.value("session", "")}};
    if (row.contains("lux")) level["lux"] = row["lux"];
    if (row.contains("measures"))
      for (const auto& [measure, values] : row["measures"].items())
        for (const char* detail : {"mean_error", "stddev", "coverage", "of_ceiling", "outliers"})
          if (values.contains(detail)) level[measure][detail] = values[detail];
    levels.push_back(std::move(level));
  }
  if (missing > 0)
    progress_.warn(fmt::format("stopped: {} of {} are missing; the same command goes on", missing, points));
  if (failed > 0) progress_.warn(fmt::format("{} failed: column `error` of results.csv says why", failed));
  progress_.finish_line();
  if (options_.scan.json)
    print_json({{"folder", folder_.string()},
                {"points", points},
                {"reused", store.reused()},
                {"missing", missing},
                {"failed", failed},
                {"left_out", evaluation_.refusals()},
                {"levels", levels}});
  else
    std::printf("%zu of %zu recorded and measured: look at %s\n", points - missing, points,
                printable((folder_ / "report.html").string()).c_str());
  return missing > 0 || failed > 0 ? kPartial : kOk;
}

int experiment(const ExperimentOptions& options) {
  const StopOnSignal stop_on_signal;
  Progress progress;
  return Experiment(options, progress).run();
}

}  // namespace

void add_experiment(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand(
      "experiment",
      "Record a session at each light level of a benchmark file, and measure them: the paper's Figure 10");
  ExperimentOptions& o = options_of(c, chosen, &experiment);
  o.scan.command = "experiment";
  c->footer(
      "On a real rig you are asked for each level, and the lux meter confirms it. Run the same command again to go on\n"
      "after an interruption.\n"
      "Exit codes: 0 done; 1 failed; 2 wrong command line; 3 in part: stopped, or a level failed.\n"
      "Example: tankrig experiment etc/benchmarks/paper-figure-10.xml --rig tank-true --calibration calibration.yaml");
  c->add_option("file", o.file, "Benchmark file, XML (docs/reference/benchmark.md)")
      ->required()
      ->check(CLI::ExistingFile);
  add_rig_option(c, o.scan.rig);
  c->add_option("--preset", o.scan.preset, "Preset of the rig file");
  add_calibration_option(c, o.scan.calibration);
  add_world_options(c, o.scan.world);
  add_carrier_option(c, o.scan.carrier);
  c->add_option("--operator", o.scan.operator_name, "Name of whoever runs the experiment");
  c->add_option("--notes", o.scan.notes, "Free text to keep in each session");
  c->add_option("--again", o.again, "Record this level [lx] once more; its earlier session is kept beside it");
  c->add_option("--out", o.out,
                "Folder of sessions and results; go on where it was stopped (default: experiments/NAME)");
  c->add_flag("--yes", o.scan.yes, "With devices: do not ask before anything moves or shines");
  add_waive_option(c, o.scan.waived);
  add_json_flag(c, o.scan.json);
}

}  // namespace tankrig::app
