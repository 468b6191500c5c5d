#include "apps/tankrig/serve/score_upload.hpp"

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/bench/external_cloud.hpp"
#include "apps/tankrig/bench/scratch_folder.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "bench/benchmark/benchmark_element.hpp"
#include "bench/external/sandbox.hpp"
#include "bench/metrics/bootstrap.hpp"
#include "bench/metrics/metrics_json.hpp"
#include "bench/metrics/verdict_cloud.hpp"
#include "bench/report/cloud_view.hpp"
#include "bench/report/figures.hpp"
#include "bench/report/report_html.hpp"
#include "bench/report/web_programs.hpp"
#include "bench/sweep/chart.hpp"
#include "console/platform/archive.hpp"
#include "core/input_error.hpp"
#include "core/picture_codecs.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "pipeline/report_session.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

using nlohmann::ordered_json;

constexpr rlim_t kMostMemory = 8ULL << 30;                                    // address space, of this program
constexpr RunLimits kMostOfStranger{300, 300, 2ULL << 30, 256ULL << 20, 64};  // whatever the archive asks for
constexpr ArchiveLimits kMostOfArchive{256ULL << 20, 2000};
constexpr const char* kAlgorithmFile = "algorithm.xml";

struct ScoreOptions {
  fs::path session, upload, to;
  std::string uses = "laser", name = "cloud";
};

bool is_archive(const fs::path& upload) { return upload.extension() != ".ply" && upload.extension() != ".pcd"; }

/// Below the folder that an archive of one folder may have around it.
fs::path program_folder(const fs::path& unpacked) {
  if (fs::exists(unpacked / kAlgorithmFile)) return unpacked;
  for (const auto& entry : fs::directory_iterator(unpacked))
    if (fs::exists(entry.path() / kAlgorithmFile)) return entry.path();
  throw InputError(fmt::format("archive: has no {}, expected an <algorithm> that names the program", kAlgorithmFile));
}

/// Errors: InputError that does not name this machine's folders.
Algorithm read_stranger(const fs::path& folder) {
  Algorithm algorithm;
  try {
    algorithm = read_algorithm(XmlElement::load(folder / kAlgorithmFile, "algorithm", {"algorithm", 64 << 10}));
  } catch (const InputError& e) {
    throw InputError(without(e.what(), folder.string() + "/"));
  }
  const auto outside = [&] {
    return InputError(fmt::format("{}: <program>: found '{}', expected an executable file of the archive",
                                  kAlgorithmFile, shown_text(algorithm.program.string())));
  };
  if (!stays_inside(algorithm.program)) throw outside();
  algorithm.program = folder / algorithm.program;
  if (!fs::is_regular_file(algorithm.program) || ::access(algorithm.program.c_str(), X_OK) != 0) throw outside();
  RunLimits& l = algorithm.limits;
  const RunLimits& most = kMostOfStranger;
  l = {std::min(l.wall_s, most.wall_s), std::min(l.cpu_s, most.cpu_s), std::min(l.memory_bytes, most.memory_bytes),
       std::min(l.disk_bytes, most.disk_bytes), std::min(l.processes, most.processes)};
  return algorithm;
}

/// A stranger's program runs; its cloud is kept beside the score.
/// Errors: InputError that says what was wrong with it.
Reconstruction run_archive(const ScoreOptions& o, const PipelineParameters& parameters, std::string& uses) {
  if (const std::string trouble = sandbox_trouble(); !trouble.empty())
    throw InputError("algorithms are refused: " + trouble);
  ScratchFolder scratch("tankrig-program");
  fs::permissions(scratch.path(), fs::perms(0755));
  unpack_archive(o.upload, scratch.path(), kMostOfArchive);
  const fs::path folder = program_folder(scratch.path());
  const Algorithm algorithm = read_stranger(folder);
  uses = algorithm.by_laser ? "laser" : "stereo";
  const OpenedSession opened = open_session(o.session);
  const std::string rig_yaml = read_whole_file(o.session / "rig.yaml");
  Reconstruction out =
      external_reconstruction(algorithm, {opened.session, opened.joints, rig_yaml}, parameters.workspace,
                              StopOnSignal::requested(), Stranger{folder, o.to / "log.txt"});
  if (!out.reason.empty()) throw InputError(out.reason);
  write_cloud(o.to / "cloud.ply", out.cloud);
  return out;
}

Reconstruction read_upload(const ScoreOptions& o, const PipelineParameters& parameters) {
  Reconstruction out;
  out.cloud = cloud_from_others(o.upload);
  if (parameters.workspace)
    out.rejected =
        std::erase_if(out.cloud.points, [&](const CloudPoint& p) { return !contains(*parameters.workspace, p.p); });
  return out;
}

ordered_json or_null(const std::optional<Interval>& interval) {
  return interval ? ordered_json(*interval) : ordered_json(nullptr);
}

double harmonic(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

/// Precision, recall and F at the tightest tolerance of coverage, as Tanks and Temples has them. Of the interval of F,
/// precision is drawn and recall kept.
ordered_json f_score(const PointCloud& cloud, const Metrics& metrics) {
  const Coverage& tightest = metrics.coverage.front();
  Metrics within = metrics;  // for the draws: whatever is not within the tolerance is an outlier
  double near = 0, all = 0;
  for (std::size_t i = 0; i < metrics.verdicts.size(); ++i) {
    if (metrics.verdicts[i] == PointVerdict::kGround || !cloud.points[i].p.allFinite()) continue;
    const bool good = metrics.distances[i] <= tightest.threshold_m;
    within.verdicts[i] = good ? PointVerdict::kObject : PointVerdict::kOutlier;
    near += good, all += 1;
  }
  const double precision = all > 0 ? near / all : 0;
  ordered_json out{{"tolerance_m", tightest.threshold_m},
                   {"precision", precision},
                   {"recall", tightest.whole},
                   {"f_score", harmonic(precision, tightest.whole)},
                   {"f_score_interval", nullptr}};
  if (const auto bad = bootstrap_errors(cloud, within).outliers)
    out["f_score_interval"] = {harmonic(1 - (*bad)[1], tightest.whole), harmonic(1 - (*bad)[0], tightest.whole)};
  return out;
}

/// What a leaderboard shows of a score.
ordered_json figures_of(const PointCloud& cloud, const Metrics& metrics) {
  const ErrorIntervals intervals = bootstrap_errors(cloud, metrics);
  const nlohmann::json all = to_json(metrics);
  ordered_json out = f_score(cloud, metrics);
  for (const char* key : {"mean_error_m", "stddev_m", "coverage", "coverage_of_ceiling", "outliers", "points"})
    out[key] = all.at(key);
  out["mean_error_interval_m"] = or_null(intervals.mean);
  out["stddev_interval_m"] = or_null(intervals.stddev);
  out["outliers_interval"] = or_null(intervals.outliers);
  const Coverage& c = metrics.headline();
  out["coverage_interval"] = {std::max(0.0, c.whole - 1.96 * c.whole_sigma),
                              std::min(1.0, c.whole + 1.96 * c.whole_sigma)};
  return out;
}

/// Shares of points and of surface within a distance.
Chart distance_chart(const std::string& name, const PointCloud& cloud, const Metrics& metrics) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    if (metrics.verdicts[i] != PointVerdict::kGround && cloud.points[i].p.allFinite())
      distances.push_back(metrics.distances[i]);
  std::ranges::sort(distances);
  ChartCurve points{name, {}}, surface{name, {}};
  constexpr int kSteps = 40;
  for (int k = 0; k <= kSteps && !distances.empty(); ++k) {
    const double d = metrics.thresholds.outlier_m * 2 * k / kSteps;
    const auto within = std::ranges::upper_bound(distances, d) - distances.begin();
    points.points.push_back({1e3 * d, 100.0 * static_cast<double>(within) / static_cast<double>(distances.size())});
  }
  for (const Coverage& c : metrics.coverage)
    surface.points.push_back(
        {1e3 * c.threshold_m, 100 * c.whole,
         std::array{100 * (c.whole - 1.96 * c.whole_sigma), 100 * (c.whole + 1.96 * c.whole_sigma)}});
  Chart chart;
  chart.panels.push_back({"Points within a distance of the object", "distance [mm]", "share [%]", {points}});
  chart.panels.push_back({"Surface within a distance of a point", "distance [mm]", "share [%]", {surface}});
  return chart;
}

void write_page(const ScoreOptions& o, const std::string& uses, const Session& session, const ObjectSurface& object,
                const Score& score, const PointCloud& cloud, const ordered_json& behind) {
  ReportData report;
  report.title = o.name;
  const auto add_picture = [&](const std::string& name, const std::string& caption, const std::string& png) {
    write_whole_file(o.to / (name + ".png"), png);
    report.pictures.push_back({"", caption, o.to / (name + ".png")});
  };
  add_picture("distances", "points and surface within a distance",
              picture_png(chart_picture(distance_chart(o.name, cloud, score.metrics))));
  const Pictures pictures = draw_pictures(session, object, score);
  for (const auto& [name, caption] : {std::pair{"camera", "cloud over the object, from the camera"},
                                      std::pair{"back", "cloud over the object, from the back"},
                                      std::pair{"coverage", "coverage on the unfolded object"}})
    if (const auto png = pictures.find(uses + "_" + name); png != pictures.end())
      add_picture(name, caption, png->second);
  if (!cloud_view_program().empty()) {
    const Transform oMb = session.info.object->bMo.inverse();
    std::vector<ViewedLines> cameras;
    for (const CalibratedCamera& camera : session.info.cameras)
      cameras.push_back(camera_pyramid(camera.name, camera.model, oMb * camera.bMc));
    report.cloud_view = cloud_view_json(object.mesh(), {{o.name, cloud, score.metrics.verdicts}}, cameras);
  }
  report.methods.push_back({o.name, score.json, {}});
  for (const auto& [what, value] : behind.items())
    report.facts.emplace_back(what, value.is_string() ? value.get<std::string>() : value.dump());
  report.command = behind.at("command");
  write_report_html(o.to / "report.html", report);
}

int score(const ScoreOptions& o) {
  // Whoever started it may be killed: then nobody wants the score.
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  ::setpriority(PRIO_PROCESS, 0, 10);
  ::umask(022);
  const rlimit memory{kMostMemory, kMostMemory};
  ::setrlimit(RLIMIT_AS, &memory);
  const StopOnSignal stop_on_signal;
  const auto begin = std::chrono::steady_clock::now();
  if (!fs::is_directory(o.to)) throw InputError(o.to, "is no folder, expected one for the score");
  check_in_no_session(o.to / "score.json");
  const Session session = Session::open(o.session);
  const PipelineParameters parameters = pipeline_parameters(session);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  std::string uses = o.uses;
  const bool archive = is_archive(o.upload);
  Reconstruction made = archive ? run_archive(o, parameters, uses) : read_upload(o, parameters);
  made.method = uses;
  const fs::path scored = archive ? o.to / "cloud.ply" : o.upload;
  const Score score = score_reconstruction(session, parameters.thresholds, object, std::move(made),
                                           session_ceiling(session, object, uses, parameters.thresholds));
  const PointCloud cloud = cloud_in_object(session, score.reconstruction);
  const ordered_json figures = figures_of(cloud, score.metrics);
  const ordered_json behind{
      {"command", fmt::format("tankrig serve score {} {} --uses {} --to FOLDER", o.session.filename().string(),
                              o.upload.filename().string(), uses)},
      {"software", TANKRIG_VERSION},
      {"session", o.session.filename().string()},
      {"session_sha256", sha256_of_file(o.session / "session.yaml")},
      {"object_sha256", sha256_of_file(o.session / session.info.object->mesh)},
      {"upload_sha256", sha256_of_file(o.upload)},
      {"cloud_sha256", sha256_of_file(scored)},
      {"uses", uses},
      {"points_outside_workspace", score.reconstruction.rejected},
      {"scored_utc", utc_now()},
      {"seconds", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()}};
  write_verdict_cloud(o.to / "verdict.ply", cloud, score.metrics);
  write_page(o, uses, session, object, score, cloud, behind);
  if (StopOnSignal::requested()) throw StoppedEarly("stopped before the score");
  const ordered_json out{
      {"figures", figures}, {"rank", figures.at("f_score")}, {"metrics", score.json}, {"behind", behind}};
  write_file_durably(o.to / "score.json", out.dump(2) + "\n");
  print_json(figures);
  return kOk;
}

}  // namespace

std::string sandbox_trouble() {
  for (const char* program : {"/usr/bin/bwrap", "/usr/bin/setpriv"})
    if (::access(program, X_OK) != 0)
      return fmt::format("{} is missing: apt-get install bubblewrap util-linux", program);
  ScratchFolder scratch("tankrig-sandbox");
  const fs::path place = scratch.path(), work = place / "work", result = place / "result";
  fs::permissions(place, fs::perms(0755));
  fs::create_directory(work);
  write_whole_file(result, "");
  fs::permissions(result, fs::perms(0666));
  LimitedRun run{{}, place, RunLimits{10, 10, 1ULL << 30, 16 << 20, 16}};
  run.command =
      sandboxed({{}, work, 1 << 20, work / "made", result, place / "filter"}, {"/bin/sh", "-c", "echo made > made"});
  const std::string wrong = run_limited({"tankrig", "bench", kProgramCommand}, run, StopOnSignal::requested());
  if (wrong.empty() && fs::file_size(result) > 0) return "";
  return fmt::format(
      "no sandbox can be made ({}: {}): allow user namespaces (sysctl kernel.unprivileged_userns_clone=1 "
      "user.max_user_namespaces=1000), in a container with the rights for them",
      wrong, last_words(run));
}

void add_score(CLI::App& serve, ChosenCommand& chosen) {
  CLI::App* c =
      serve.add_subcommand("score", "Score a cloud, or an algorithm in its archive, on a session as the platform does");
  ScoreOptions& o = options_of(c, chosen, &score);
  c->footer("Example: tankrig serve score sessions/monday cloud.ply --to score");
  add_session_option(c, o.session);
  c->add_option("upload", o.upload, "Cloud in b, .ply or .pcd; or an algorithm, .tar.gz (docs/reference/platform.md)")
      ->required()
      ->check(CLI::ExistingFile);
  c->add_option("--to", o.to, "Folder for score.json, report.html and the clouds")
      ->required()
      ->check(CLI::ExistingDirectory);
  c->add_option("--uses", o.uses, "Of a cloud: whose ceiling its coverage is compared with")
      ->check(CLI::IsMember({"laser", "stereo"}))
      ->capture_default_str();
  c->add_option("--name", o.name, "What the report calls it")->capture_default_str();
}

}  // namespace tankrig::app
