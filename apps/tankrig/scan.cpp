// `tankrig scan`: the whole road, from the rig file to the report.
#include "rig/scan/scan.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/arm_motion.hpp"
#include "apps/tankrig/backend.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/dry_run.hpp"
#include "apps/tankrig/output.hpp"
#include "apps/tankrig/pictures.hpp"
#include "apps/tankrig/played_faults.hpp"
#include "apps/tankrig/progress.hpp"
#include "apps/tankrig/rig_files.hpp"
#include "apps/tankrig/scores.hpp"
#include "apps/tankrig/stop.hpp"
#include "apps/tankrig/summary.hpp"
#include "apps/tankrig/timing.hpp"
#include "core/input_error.hpp"
#include "core/utc.hpp"
#include "rig/capture/beam_view.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/plan/plan_csv.hpp"
#include "rig/session/checksums.hpp"
#include "rig/session/session_writer.hpp"
#include "rig/session/sha256.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// The session as the scan's sink.
class SessionSink final : public ScanSink {
 public:
  SessionSink(SessionWriter& writer, PlayedFaults& faults, Progress& progress)
      : writer_(writer), faults_(faults), progress_(progress) {}
  void joints(const JointState& state) override {
    faults_.write(false);
    writer_.joints(state);
  }
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    faults_.write(true);
    writer_.frame(record, image);
  }
  /// A fault is told at once: what follows may take seconds.
  void event(Stamp when, std::string_view kind, const std::string& text) override {
    if (kind == "fault") progress_.warn(text);
    if (kind == "phase") faults_.enter_phase(text, when);
    writer_.event(when, kind, text);
  }

 private:
  SessionWriter& writer_;
  PlayedFaults& faults_;
  Progress& progress_;
};

/// sessions/RIG-20170503T091244Z, numbered if there is one already.
fs::path default_session(const std::string& rig) {
  std::string stamp = utc_now();
  std::erase_if(stamp, [](char c) { return c == '-' || c == ':'; });
  const fs::path base = fs::path("sessions") / (rig + "-" + stamp);
  fs::path path = base;
  for (int n = 2; fs::exists(path); ++n) path = base.string() + "-" + std::to_string(n);
  return path;
}

void check_lux(const std::string& lux) {
  if (lux == "auto") return;
  std::size_t used = 0;
  double value = -1;
  try {
    value = std::stod(lux, &used);
  } catch (const std::exception&) {
    used = std::string::npos;
  }
  if (used != lux.size() || !std::isfinite(value) || value < 0)
    throw InputError("--lux: found '" + lux + "', expected auto or a number of at least 0");
}

double read_lux(Backend& backend) {
  const auto reading = backend.lux_meter().read(std::chrono::seconds(2));
  if (!reading)
    throw InputError(std::string("lux meter: ") + reading.error().where + ": " + to_string(reading.error().code) +
                     ", expected a reading (or give --lux VALUE)");
  return reading.value().lux;
}

SessionInfo session_info_of(const ScanOptions& options, const RigConfig& rig, Backend& backend, const fs::path& path) {
  SessionInfo info;
  info.name = path.filename().string();
  info.kind = "scan";
  info.operator_name = options.operator_name;
  info.notes = options.notes;
  info.software = TANKRIG_VERSION;
  info.noise = backend.noise();
  info.seed = options.seed;
  if (backend.world()) info.light = backend.world()->light();
  rig.describe(info);
  info.clock_begin = read_clock_pair(backend.clock());
  return info;
}

/// Moves the arm and records the session. `left`: how laser and arm were left; nothing if they were not touched.
/// Errors: what the disk refuses.
ScanResult record(const ScanOptions& options, const RigConfig& rig, const ScanPlan& plan, Backend& backend,
                  const fs::path& path, Progress& progress, std::optional<OutputsLeft>& left) {
  SessionInfo info = session_info_of(options, rig, backend, path);
  const bool meter = options.lux == "auto" && rig.read_lux;
  if (meter || options.lux != "auto") {
    info.lux_source = meter ? "meter" : "hand";
    info.lux_before = meter ? read_lux(backend) : std::stod(options.lux);
  }
  const std::string mesh = rig.object.mesh.filename().string();
  const std::string rig_file = resolved_rig_yaml(rig, mesh);
  info.rig_hash = sha256_of_text(rig_file);
  SessionWriterOptions writer_options;
  writer_options.wait_when_full = !backend.clock().real_time();
  SessionWriter writer(path, std::move(info), writer_options);
  writer.add_file(rig.object.mesh, mesh);
  writer.add_text("rig.yaml", rig_file);
  writer.add_text("plan.csv", plan_csv(plan));

  fs::create_directory(path / "cameras");
  for (const RigCamera& camera : rig.cameras)
    write_camera_file(path / "cameras" / (camera.name + ".yaml"), camera.model, camera.name);

  backend.record_wire(path);
  PlayedFaults faults(backend, writer, options.faults);
  SessionSink sink(writer, faults, progress);
  std::vector<ScanCamera> cameras;
  const std::vector<Camera*> devices = backend.cameras();
  for (std::size_t i = 0; i < devices.size(); ++i)
    cameras.push_back({devices[i], rig.cameras[i].record, stripe_in_view(rig, rig.cameras[i]), rig.cameras[i].trigger,
                       rig.cameras[i].time_offset});
  ScanJob job{plan,
              rig.scan,
              backend.clock(),
              backend.arm(),
              backend.laser(),
              cameras,
              sink,
              StopOnSignal::requested(),
              [&] { return faults.round(); },
              [&](const ScanProgress& p) { progress.update("scan: " + p.segment, p.fraction); }};
  ScanResult result;
  try {
    result = run_scan(job);
  } catch (const std::exception& e) {
    left = job.left;
    backend.end_wire_record();
    try {
      writer.close(std::string("stopped: ") + e.what());
    } catch (const std::exception&) {  // the disk, most likely: told already
    }
    throw;
  }
  left = result.left;
  for (const std::string& fault : faults.never_began()) {
    progress.warn("faults: " + fault + ": never began");
    writer.event(backend.clock().now(), "injected", fault + " never began");
  }
  if (meter && result.complete()) try {
      writer.info().lux_after = read_lux(backend);
    } catch (const InputError& e) {
      progress.warn(e.what());
      writer.event(backend.clock().now(), "fault", e.what());
    }
  writer.info().simulated_s = result.simulated_s;
  keep_timing(writer, rig, result);
  if (backend.clock().real_time()) writer.info().clock_end = read_clock_pair(backend.clock());
  writer.info().counts.insert(result.counts.begin(), result.counts.end());
  backend.end_wire_record();
  for (const Statistic& s : backend.statistics()) writer.info().devices[s.name] = s.value;
  for (const Statistic& s : result.sync) writer.info().devices[s.name] = s.value;
  const std::atomic<bool>* stop = StopOnSignal::requested() ? nullptr : &StopOnSignal::requested();
  writer.close(result.status, {[&](double fraction) { progress.update("writing pictures", fraction); }, stop});
  write_checksums(path);
  for (const auto& [name, count] : writer.info().counts) result.counts[name] = count;
  return result;
}

int stopped(const fs::path& path, const std::string& why, const std::optional<OutputsLeft>& left, Progress& progress) {
  try {
    write_checksums(path);
  } catch (const InputError& e) {
    progress.warn(e.what());
  }
  progress.warn("scan " + why + "; " + (left ? to_string(*left) : "laser and arm were not touched") +
                ", session kept in " + path.string());
  return kPartial;
}

/// Warns of every camera that recorded clearly less than the plan holds. True if one has too little to make a cloud of.
bool frames_are_missing(const RigConfig& rig, const ScanPlan& plan, const ScanResult& result, Progress& progress) {
  bool too_few = false;
  for (const RigCamera& camera : rig.cameras) {
    const int expected = expected_frames(rig, camera, plan);
    std::uint64_t recorded = 0;
    std::string reasons;
    for (const auto& [name, count] : result.counts) {
      if (name == camera.name + ".recorded")
        recorded = count;
      else if (name.starts_with(camera.name + ".") && count > 0)
        reasons += (reasons.empty() ? "" : ", ") + name.substr(camera.name.size() + 1) + " " + std::to_string(count);
    }
    if (static_cast<double>(recorded) >= 0.9 * expected) continue;
    progress.warn("camera " + camera.name + ": " + std::to_string(recorded) + " of " + std::to_string(expected) +
                  " frames recorded: " + (reasons.empty() ? "no others came" : reasons));
    too_few = too_few || static_cast<double>(recorded) < 0.5 * expected;
  }
  return too_few;
}

}  // namespace

int scan(const ScanOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  check_lux(options.lux);
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig), options.preset);
  const ReconstructionParameters parameters = reconstruction_parameters(rig.root);
  const StopOnSignal stop_on_signal;  // before the devices: it outlives them
  const std::unique_ptr<Backend> backend =
      make_backend(rig, {.world = {options.light, options.noise, options.sensor, options.particles, options.seed},
                         .carrier = options.carrier,
                         .faults = options.faults});
  for (const std::string& warning : backend->warnings()) progress.warn(warning);
  for (const Statistic& s : backend->statistics())
    if (s.name == "arm.bus_load_percent")
      progress.note("arm: its wire is busy for " + std::to_string(std::lround(s.value)) + " % of the time");

  const JointVector posture = homed_posture(*backend, options.rig);
  const ScanPlan plan = make_scan_plan(rig.scan, posture);
  check_light(plan, rig.scan.safety);
  const MotionCheck clearance = check_plan(rig, plan);
  if (options.dry_run) {
    print_dry_run(rig, plan, clearance, options.json);
    return kOk;
  }

  const fs::path path = options.out.empty() ? default_session(rig.name) : options.out;
  if (fs::exists(path)) throw InputError(path, "exists already, expected a new session directory");
  check_laser_ready(rig.scan, backend->laser(), backend->interlock_closed());
  auto stops = std::make_unique<RigStops>(*backend, progress);
  if (backend->clock().real_time())
    if (const std::string missing = check_real_time(rig.scan.real_time); !missing.empty())
      progress.warn("real time " + missing);
  if (StopOnSignal::requested()) {
    progress.warn("scan stopped before anything moved");
    return kPartial;
  }
  ScanResult result;
  std::optional<OutputsLeft> left;
  try {
    result = record(options, rig, plan, *backend, path, progress, left);
    stops.reset();
  } catch (const std::exception& e) {
    if (!left && !fs::exists(path / "session.yaml")) throw;
    return stopped(path, std::string("stopped: ") + e.what(), left, progress);
  }
  if (result.times && !options.json) {
    progress.finish_line();
    print_timing(rig, result);
  }
  if (!result.complete()) return stopped(path, result.status, left, progress);
  if (has_spool(path)) return stopped(path, "stopped while writing pictures (tankrig session recover)", left, progress);
  const bool partial = frames_are_missing(rig, plan, result, progress);

  const Session session = Session::open(path);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  const std::vector<Score> scores =
      reconstruct_and_score(session, parameters, object, StopOnSignal::requested(), progress);
  if (StopOnSignal::requested()) {
    write_checksums(path);
    progress.warn("stopped before the report; the scan is complete: tankrig report " + path.string());
    return kPartial;
  }
  progress.update("pictures and report", 0);
  write_pictures_and_report(session, object, scores, backend->world());
  write_checksums(path);
  progress.update("pictures and report", 1);
  progress.finish_line();

  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  if (options.json) {
    nlohmann::ordered_json out = scores_json(scores);
    out["session"] = path.string();
    out["wall_s"] = wall;
    out["simulated_s"] = result.simulated_s;
    out["frames"] = session.frames.size();
    if (result.times) out["timing"] = timing_json(rig, result);
    print_json(out);
  } else {
    std::printf("%s%s", score_table(tabled(scores)).c_str(), sync_line(result.sync).c_str());
    std::printf("%zu frames, a scan of %.1f s%s, all in %.1f s\nlook at %s\n", session.frames.size(),
                result.simulated_s, backend->clock().real_time() ? "" : " simulated", wall,
                (path / "report.html").c_str());
  }
  return partial ? kPartial : kOk;
}

}  // namespace tankrig::app
