// `tankrig scan`: the whole road, from the rig file to the report.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/command_line/waiting.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "apps/tankrig/results/coverage_option.hpp"
#include "apps/tankrig/results/summary.hpp"
#include "apps/tankrig/scan/dry_run.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "apps/tankrig/scan/ready_rig.hpp"
#include "apps/tankrig/scan/record_session.hpp"
#include "apps/tankrig/scan/shown_scan.hpp"
#include "apps/tankrig/scan/timing.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/utc.hpp"
#include "pipeline/report_session.hpp"
#include "pipeline/score_session.hpp"
#include "rig/scan/scan.hpp"
#include "session/checking/checksums.hpp"
#include "session/recording/session_lock.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

int told_stopped(const fs::path& path, const std::string& why, const std::optional<EndState>& left, bool finished,
                 Progress& progress) {
  progress.warn("scan " + why + "; " + (left ? to_string(*left) : "laser and arm were not touched") +
                ", session kept in " + printable(path.string()) +
                (finished ? "" : ", not finished: tankrig session recover"));
  return kPartial;
}

int stopped(const fs::path& path, const std::string& why, const std::optional<EndState>& left, Progress& progress) {
  bool sealed = false;
  try {
    write_checksums(path);
    sealed = true;
  } catch (const std::exception& e) {
    progress.warn(e.what());
  }
  return told_stopped(path, why, left, sealed && !has_spool(path), progress);
}

/// Warns of every camera that recorded clearly less than the plan holds. True if one has too little to make a cloud of,
/// or if nobody knows what became of frames.
bool frames_are_missing(const RigConfig& rig, const ScanPlan& plan, const ScanResult& result, Progress& progress) {
  bool too_few = false;
  for (const RigCamera& camera : rig.cameras) {
    const int expected = expected_frames(rig, camera, plan);
    const std::uint64_t recorded = result.counts.at(camera.name + ".recorded");
    too_few = too_few || !result.account.at(camera.name).closes();
    if (static_cast<double>(recorded) >= 0.9 * expected) continue;
    progress.warn(fmt::format("camera {}: {} frames recorded, the plan holds {}", camera.name, recorded, expected));
    too_few = too_few || static_cast<double>(recorded) < 0.5 * expected;
  }
  return too_few;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

nlohmann::ordered_json json_of(const LiveFigures& live) {
  return {{"frames", live.frames},  {"passed_over", live.passed_over}, {"lines", live.lines},
          {"points", live.points},  {"columns", live.columns},         {"found", live.found},
          {"clipped", live.clipped}};
}

/// Frames that became no pictures yet, and the seal. Nothing if there are none; else how the command ends, if it ends
/// here.
std::optional<int> write_pictures(const fs::path& path, const Recording& recording, const std::optional<EndState>& left,
                                  Progress& progress) {
  if (recording.unwritten.empty()) return std::nullopt;
  try {
    write_spooled_pictures(
        path, {[&](double fraction) { progress.update("writing pictures", fraction); }, StopOnSignal::from_now_on()});
  } catch (const NotOnDisk& e) {
    return told_stopped(path, std::string("stopped: ") + e.what(), left, false, progress);
  } catch (const std::exception& e) {
    return stopped(path, std::string("stopped: ") + e.what(), left, progress);
  }
  if (has_spool(path)) return stopped(path, "stopped while writing pictures", left, progress);
  write_checksums(path);
  return std::nullopt;
}

/// What was made while the arm moved; trouble that has not been told of yet is told.
ReadyReport ready_report(const Recording& recording, const Session& session, Progress& progress) {
  if (!recording.live) return {};
  const std::string told = recording.live->trouble();
  ReadyReport ready = recording.live->finish(session, StopOnSignal::requested(), progress.callback());
  if (const std::string trouble = recording.live->trouble(); trouble != told)
    progress.warn("live: " + trouble + "; the report is made from the session");
  return ready;
}

nlohmann::ordered_json scan_json(const RigConfig& rig, const Session& session, const std::vector<Score>& scores,
                                 const Recording& recording, double report_s, double wall_s) {
  const ScanResult& result = recording.result;
  nlohmann::ordered_json out = scores_json(scores);
  out["session"] = session.path.string();
  out["wall_s"] = wall_s;
  out["simulated_s"] = result.simulated_s;
  out["report_after_parking_s"] = report_s;
  out["frames"] = session.frames.size();
  if (recording.live) out["live"] = json_of(recording.live->figures());
  for (const auto& [camera, account] : result.account) {
    nlohmann::ordered_json& frames = out["cameras"][camera];
    frames = {{"expected", account.expected}, {"recorded", result.counts.at(camera + ".recorded")}};
    frames["left_out"] = nlohmann::ordered_json::object();
    for (const auto& [reason, count] : frame_reasons(result.counts, camera)) frames["left_out"][reason] = count;
    frames["unaccounted"] = account.unaccounted;
  }
  if (result.times) out["timing"] = timing_json(session_timing(*result.times, rig.scan.cycle_hz));
  return out;
}

void print_scan(const Session& session, const std::vector<Score>& scores, const ScanResult& result, bool coverage,
                bool real_time, double report_s, double wall_s) {
  std::printf("%s%s%s", score_table(tabled(scores)).c_str(), coverage ? coverage_table(tabled(scores)).c_str() : "",
              sync_line(result.sync).c_str());
  std::printf("%zu frames, a scan of %.1f s%s, its report %.1f s after it, all in %.1f s\nlook at %s\n",
              session.frames.size(), result.simulated_s, real_time ? "" : " simulated", report_s, wall_s,
              (session.path / "report.html").c_str());
}

int scan(const ScanOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  check_lux(options.lux);
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig), options.preset, options.calibration);
  for (const std::string& warning : calibration_warnings(rig)) progress.warn(warning);
  PipelineParameters parameters = pipeline_parameters(rig.root);
  set_coverage(parameters.thresholds, options.coverage_mm);
  if (options.dry_run) {
    if (!rig.scene.empty())
      for (const std::string& warning : scene_warnings(rig, load_world(rig, options.world))) progress.warn(warning);
    const ScanPlan plan = sweep_plan(rig, rig.scan.park);
    print_dry_run(rig, plan, check_plan(rig, plan), options.json, options.draw);
    return kOk;
  }
  const fs::path path = options.out.empty() ? default_session(rig.name) : options.out;
  ReadyRig ready_rig(
      options, rig, path, [&rig](const JointVector& posture) { return sweep_plan(rig, posture); }, progress);
  Backend& backend = ready_rig.backend();
  const ScanPlan& plan = ready_rig.plan();
  Motion& motion = ready_rig.motion();
  Recording recording;
  try {
    recording =
        record_session(options, rig, &parameters, plan, backend, path, ready_rig.commission(), progress, motion);
    ready_rig.disarm();
  } catch (const NotOnDisk& e) {
    return told_stopped(path, std::string("stopped: ") + e.what(), motion.left(), false, progress);
  } catch (const std::exception& e) {
    if (!motion.left() && !fs::exists(path / "session.yaml")) throw;
    return stopped(path, std::string("stopped: ") + e.what(), motion.left(), progress);
  }
  const ScanResult& result = recording.result;
  if (result.times && !options.json) {
    progress.finish_line();
    print_timing(rig, result);
  }
  if (!result.complete()) return stopped(path, result.status, motion.left(), progress);
  if (recording.unwritten.empty() && has_spool(path))
    return stopped(path, "stopped while writing pictures", motion.left(), progress);
  const bool partial = frames_are_missing(rig, plan, result, progress);

  std::optional<Waiting> waiting(std::in_place, "another program to finish reading " + printable(path.string()));
  const SessionLock at_rest(path, SessionUse::kWrite, std::chrono::minutes(10));
  waiting.reset();
  const Session session = Session::open(path, recording.unwritten);
  OutsideView outside;
  if (const sim::TankWorld* tank = backend.world())
    outside = [tank](const JointVector& q, bool laser_on) { return tank->render_external(q, laser_on, 1280, 860); };
  ReadyReport ready = ready_report(recording, session, progress);
  std::optional<std::vector<Score>> scores;
  try {
    scores = reconstruct_and_report(session, parameters, StopOnSignal::requested(), progress.callback(), outside,
                                    std::move(ready));
  } catch (const std::exception&) {
    write_pictures(path, recording, motion.left(), progress);
    throw;
  }
  const double report_s = seconds_since(recording.parked);
  const std::optional<int> ended = write_pictures(path, recording, motion.left(), progress);
  progress.finish_line();
  if (ended) return *ended;
  if (!scores) {
    progress.warn("stopped before the report; the scan is complete: tankrig report " + path.string());
    return kPartial;
  }
  warn_of(*scores, progress);
  show_scores(*scores);
  const double wall = seconds_since(began);
  if (options.json)
    print_json(scan_json(rig, session, *scores, recording, report_s, wall));
  else
    print_scan(session, *scores, result, !options.coverage_mm.empty(), backend.clock().real_time(), report_s, wall);
  return partial ? kPartial : kOk;
}

}  // namespace

void add_scan(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("scan", "Sweep the arm, record a session, reconstruct and score it, write a report");
  ScanOptions& o = options_of(c, chosen, &scan);
  c->footer(
      "Exit codes: 0 done; 1 failed; 2 wrong command line; 3 in part: stopped, or frames are missing.\n"
      "Example: tankrig scan --rig tank-sim --light 0.5 --noise 0.02 --json");
  add_rig_option(c, o.rig);
  c->add_option("--preset", o.preset, "Preset of the rig file; the shipped rigs have 'fine'");
  add_calibration_option(c, o.calibration);
  add_world_options(c, o.world);
  c->add_option("--lux", o.lux, "Ambient light [lx]; 'auto' reads the lux meter before and after the sweep")
      ->capture_default_str();
  add_carrier_option(c, o.carrier);
  c->add_option("--faults", o.faults, "Fault plan to play on simulated or emulated devices (docs/reference/faults.md)")
      ->check(CLI::ExistingFile);
  c->add_option("--operator", o.operator_name, "Name of whoever runs the experiment");
  c->add_option("--notes", o.notes, "Free text to keep in the session");
  c->add_option("--out", o.out, "Session folder to make (default: sessions/RIG-DATE)");
  c->add_flag("--dry-run", o.dry_run,
              "Print path from the park posture, clearance, duration, disk need and view; use no device");
  c->add_flag("--yes", o.yes, "With devices: do not ask before anything moves or shines");
  add_waive_option(c, o.waived);
  add_coverage_option(c, o.coverage_mm);
  add_json_flag(c, o.json);
  c->add_flag("--draw", o.draw, "With --dry-run and --json: also what draws it in 3D, as the console does")
      ->needs("--dry-run")
      ->needs("--json");
}

}  // namespace tankrig::app
