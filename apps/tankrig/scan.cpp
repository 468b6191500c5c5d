// `tankrig scan`: the whole road, from the rig file to the report.
#include "rig/executive/scan.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "apps/tankrig/backend.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/pictures.hpp"
#include "apps/tankrig/progress.hpp"
#include "apps/tankrig/rig_files.hpp"
#include "apps/tankrig/scores.hpp"
#include "apps/tankrig/summary.hpp"
#include "apps/tankrig/surface_view.hpp"
#include "bench/metrics/triangle_mesh.hpp"
#include "core/input_error.hpp"
#include "rig/executive/motion_check.hpp"
#include "rig/session/checksums.hpp"
#include "rig/session/session_writer.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

std::atomic<bool> stop_requested{false};

extern "C" void request_stop(int) { stop_requested.store(true); }

/// While it lives, Ctrl-C and a polite kill ask the scan to stop; a second one ends the program at once.
class StopOnSignal {
 public:
  StopOnSignal() {
    struct sigaction action {};
    action.sa_handler = request_stop;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    for (int s : {SIGINT, SIGTERM, SIGHUP}) sigaction(s, &action, nullptr);
  }
  ~StopOnSignal() {
    for (int s : {SIGINT, SIGTERM, SIGHUP}) std::signal(s, SIG_DFL);
  }
};

/// The session as the scan's sink.
class SessionSink final : public ScanSink {
 public:
  explicit SessionSink(SessionWriter& writer) : writer_(writer) {}
  void joints(const JointState& state) override { writer_.joints(state); }
  void frame(const FrameRecord& record, const cv::Mat& image) override { writer_.frame(record, image); }
  void event(Stamp when, std::string_view kind, const std::string& text) override { writer_.event(when, kind, text); }

 private:
  SessionWriter& writer_;
};

fs::path default_session(const std::string& rig) {
  const std::time_t now = std::time(nullptr);
  char stamp[32];
  std::strftime(stamp, sizeof stamp, "%Y%m%dT%H%M%SZ", std::gmtime(&now));
  const fs::path base = fs::path("sessions") / (rig + "-" + stamp);
  fs::path path = base;
  for (int n = 2; fs::exists(path); ++n) path = base.string() + "-" + std::to_string(n);
  return path;
}

Obstacles obstacles_of(const RigConfig& rig) {
  Obstacles out;
  out.tank_size = rig.obstacles.tank_size;
  out.wMb = rig.obstacles.wMb;
  out.margin = rig.obstacles.margin;
  out.link_radius = rig.obstacles.link_radius;
  out.tool_length = rig.obstacles.tool_length;
  for (const RigCarriedBody& body : rig.obstacles.carried) out.carried.push_back({body.from_e, body.to_e, body.radius});
  const Eigen::AlignedBox3d box = read_mesh(rig.object.mesh).bounds();
  out.boxes.push_back({"object", rig.object.bMo * Eigen::Translation3d(box.center()), 0.5 * box.sizes()});
  return out;
}

int expected_frames(const ScanPlan& plan, const RigConfig& rig) {
  int frames = 0;
  for (const RigCamera& camera : rig.cameras)
    frames += plan.expected_frames(camera.record, 1 / camera.rate_hz, rig.scan.dark_frames);
  return frames;
}

/// Upper bound: images as they come from the camera, before compression [bytes].
double disk_need(const ScanPlan& plan, const RigConfig& rig) {
  double bytes = 0;
  for (const RigCamera& camera : rig.cameras)
    bytes += 3.0 * camera.model.width * camera.model.height *
             plan.expected_frames(camera.record, 1 / camera.rate_hz, rig.scan.dark_frames);
  return bytes;
}

void print_plan(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check, const SurfaceView& view,
                bool json) {
  if (json) {
    nlohmann::ordered_json out;
    for (const Segment& s : plan.segments())
      out["path"].push_back({{"segment", s.name},
                             {"begin_s", s.begin},
                             {"duration_s", s.duration},
                             {"laser", s.laser},
                             {"elbow_to_rad", plan.at(s.end()).q[kElbow]}});
    out["clearance_m"] = check.min_clearance;
    out["nearest"] = check.nearest;
    out["duration_s"] = plan.duration();
    out["frames"] = expected_frames(plan, rig);
    out["disk_bytes"] = disk_need(plan, rig);
    out["faces"] = view.json();
    std::printf("%s\n", out.dump(2).c_str());
    return;
  }
  std::printf("%-26s %8s %9s  %-5s  %s\n", "segment", "begin", "duration", "laser", "elbow at its end");
  for (const Segment& s : plan.segments())
    std::printf("%-26s %6.2f s %7.2f s  %-5s  %.3f rad\n", s.name.c_str(), s.begin, s.duration, s.laser ? "on" : "off",
                plan.at(s.end()).q[kElbow]);
  std::printf("clearance  %.0f mm, %s, during %s\n", 1e3 * check.min_clearance, check.nearest.c_str(),
              check.where.c_str());
  std::printf("duration   %.1f s\nframes     %d\ndisk need  at most %.0f MB\n", plan.duration(),
              expected_frames(plan, rig), disk_need(plan, rig) / 1e6);
  std::printf("%s", view.table().c_str());
}

double read_lux(const ScanOptions& options, Backend& backend) {
  if (options.lux != "auto") return std::stod(options.lux);
  const auto reading = backend.lux_meter().read(std::chrono::seconds(2));
  if (!reading)
    throw InputError(std::string("lux meter: ") + reading.error().where + ": " + to_string(reading.error().code) +
                     ", expected a reading (or give --lux VALUE)");
  return reading.value().lux;
}

void check_lux(const std::string& lux) {
  if (lux == "auto") return;
  std::size_t used = 0;
  double value = -1;
  try {
    value = std::stod(lux, &used);
  } catch (const std::exception&) {
  }
  if (used != lux.size() || !(value >= 0))
    throw InputError("--lux: found '" + lux + "', expected auto or a number of at least 0");
}

}  // namespace

int scan(const ScanOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  check_lux(options.lux);
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig), options.preset);
  const ReconstructionParameters parameters = reconstruction_parameters(rig.root);
  sim::WorldOptions world_options{options.light, options.noise, options.sensor, options.particles, options.seed};
  const std::unique_ptr<Backend> backend = make_backend(rig, world_options);
  if (backend->world())
    for (const std::string& warning : backend->world()->warnings()) progress.warn(warning);

  const JointVector posture = read_posture(backend->arm(), backend->clock(), std::chrono::seconds(2));
  const ScanPlan plan = make_scan_plan(rig.scan, posture);
  const MotionCheck clearance =
      check_motion(plan, rig.arm, obstacles_of(rig),
                   {rig.motion_limits.angle_margin, rig.motion_limits.max_velocity, rig.motion_limits.max_ticks_per_s});
  if (options.dry_run) {
    print_plan(rig, plan, clearance, surface_view(rig, plan), options.json);
    return kOk;
  }

  const fs::path path = options.out.empty() ? default_session(rig.name) : options.out;
  if (fs::exists(path)) throw InputError(path, "exists already, expected a new session directory");
  SessionInfo info;
  info.name = path.filename().string();
  info.kind = "scan";
  info.operator_name = options.operator_name;
  info.notes = options.notes;
  info.software = TANKRIG_VERSION;
  info.noise = backend->noise();
  info.seed = options.seed;
  if (backend->world()) info.light = backend->world()->light();
  rig.describe(info);
  if (rig.read_lux) info.lux_before = read_lux(options, *backend);

  SessionWriterOptions writer_options;
  writer_options.wait_when_full = backend->world() != nullptr;
  SessionWriter writer(path, std::move(info), writer_options);
  const std::string mesh = rig.object.mesh.filename().string();
  writer.add_file(rig.object.mesh, mesh);
  writer.add_text("rig.yaml", resolved_rig_yaml(rig, mesh));

  SessionSink sink(writer);
  std::vector<ScanCamera> cameras;
  const std::vector<Camera*> devices = backend->cameras();
  for (std::size_t i = 0; i < devices.size(); ++i) cameras.push_back({devices[i], rig.cameras[i].record});
  ScanResult result;
  {
    const StopOnSignal stop_on_signal;
    ScanJob job{plan,
                rig.scan,
                backend->clock(),
                backend->arm(),
                backend->laser(),
                cameras,
                sink,
                stop_requested,
                [&](const ScanProgress& p) { progress.update("scan: " + p.segment, p.fraction); }};
    result = run_scan(job);
  }
  if (rig.read_lux) writer.info().lux_after = read_lux(options, *backend);
  writer.info().simulated_s = result.simulated_s;
  writer.info().counts.insert(result.counts.begin(), result.counts.end());
  writer.close(result.status);
  if (!result.complete()) {
    write_checksums(path);
    progress.warn("scan " + result.status + "; laser off, arm at rest, session kept in " + path.string());
    return kPartial;
  }

  const Session session = Session::open(path);
  const ObjectSurface object = object_of(session, parameters.thresholds);
  const std::vector<Score> scores = reconstruct_and_score(session, parameters, object, progress);
  progress.update("pictures and report", 0);
  write_pictures_and_report(session, object, scores, backend->world());
  write_checksums(path);
  progress.update("pictures and report", 1);

  nlohmann::ordered_json out;
  for (const Score& score : scores) out[score.method()] = score.json;
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  out["session"] = path.string();
  out["wall_s"] = wall;
  out["simulated_s"] = result.simulated_s;
  out["frames"] = session.frames.size();
  if (options.json) {
    std::printf("%s\n", out.dump(2).c_str());
  } else {
    progress.finish_line();
    std::printf("%s", score_table(tabled(scores)).c_str());
    std::printf("%zu frames, %.1f s simulated in %.1f s\nlook at %s\n", session.frames.size(), result.simulated_s, wall,
                (path / "report.html").c_str());
  }
  return kOk;
}

}  // namespace tankrig::app
