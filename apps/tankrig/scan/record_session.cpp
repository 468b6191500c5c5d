#include "apps/tankrig/scan/record_session.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/devices/played_faults.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/scan/shown_frames.hpp"
#include "apps/tankrig/scan/shown_scan.hpp"
#include "apps/tankrig/scan/timing.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "core/camera_file.hpp"
#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "core/range_words.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "core/utc.hpp"
#include "rig/capture/beam_view.hpp"
#include "rig/plan/plan_csv.hpp"
#include "rig/scan/session_rig.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/sha256.hpp"
#include "session/recording/event_kinds.hpp"
#include "session/recording/session_writer.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// The live reconstruction as the operator sees it. Whatever becomes of it, the scan goes on.
class LiveView {
 public:
  /// `parameters`: null if nothing is to be reconstructed.
  LiveView(const fs::path& session, const RigConfig& rig, const PipelineParameters* parameters, bool real_time,
           Progress& progress)
      : rig_(rig), progress_(progress) {
    show_scene(rig);
    if (!parameters) return;
    LiveOptions options;
    if (real_time) options.now = [] { return MonotonicClock::one().now(); };
    if (Feed::one().heard()) options.line = [](const LiveLine& line) { Feed::one().points(line.stamp, line.points); };
    const auto memory = static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::getpagesize());
    options.kept_bytes = std::min(options.kept_bytes, memory / 4);
    try {
      live_ = std::make_unique<LiveReconstruction>(session, *parameters, options);
    } catch (const std::exception& e) {
      tell_trouble(e.what());
    }
  }

  void frame(const FrameRecord& record, const cv::Mat& image) {
    if (live_) live_->frame(record, image);
    shown_.frame(record, image);
  }
  void all_recorded() {
    if (live_) live_->all_recorded();
  }

  void show(const ScanProgress& p) {
    show_state(rig_, p);
    const bool sweeps = live_ && p.phase == Phase::kSweep;
    if (live_) tell_trouble(live_->trouble());
    progress_.update("scan: " + p.segment, p.fraction, sweeps && told_.empty() ? in_words(live_->figures()) : "");
  }

  std::unique_ptr<LiveReconstruction> end() {
    if (!live_) return {};
    tell_trouble(live_->trouble());
    const LiveFigures figures = live_->figures();
    if (figures.passed_over > 0)
      progress_.note(
          fmt::format("live: {} of {} frames passed over in the sweep, for lack of time; the report has them",
                      figures.passed_over, figures.frames));
    return std::move(live_);
  }

 private:
  void tell_trouble(const std::string& what) {
    if (what.empty() || !told_.empty()) return;
    told_ = what;
    progress_.warn("live: " + what + "; the scan goes on, and its report is made from the session");
  }

  const RigConfig& rig_;
  Progress& progress_;
  ShownFrames shown_;
  std::unique_ptr<LiveReconstruction> live_;
  std::string told_;
};

/// The session as the scan's sink.
class SessionSink final : public ScanSink {
 public:
  /// `last_segment`: of the plan; nothing is recorded in it.
  SessionSink(SessionWriter& writer, LiveView& live, PlayedFaults& faults, Progress& progress, std::string last_segment,
              const decltype(ScanOptions::on_frame)& on_frame)
      : writer_(writer),
        live_(live),
        faults_(faults),
        progress_(progress),
        last_segment_(std::move(last_segment)),
        on_frame_(on_frame) {}
  void joints(const JointState& state) override {
    faults_.write(false);
    writer_.joints(state);
  }
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    faults_.write(true);
    writer_.frame(record, image);
    live_.frame(record, image);
    if (on_frame_) on_frame_(record, image);
  }
  /// A fault is told at once: what follows may take seconds.
  void event(Stamp when, std::string_view kind, const std::string& text) override {
    if (kind == event_kind::kFault) progress_.warn(text);
    if (kind == event_kind::kRealTime) progress_.warn("real time " + text);
    if (kind == event_kind::kPhase) faults_.enter_phase(text, when);
    if (kind == event_kind::kPhase && text == last_segment_) live_.all_recorded();
    writer_.event(when, kind, text);
  }

 private:
  SessionWriter& writer_;
  LiveView& live_;
  PlayedFaults& faults_;
  Progress& progress_;
  const std::string last_segment_;
  const decltype(ScanOptions::on_frame)& on_frame_;
};

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
  info.seed = options.world.seed;
  if (backend.world()) info.light = backend.world()->light();
  if (const auto truth = true_rig(rig, options.world)) info.truth_seed = truth->seed;
  info.clock_begin = read_clock_pair(backend.clock());
  return info;
}

/// What was counted and measured, however the scan ended.
void keep_figures(SessionWriter& writer, const RigConfig& rig, Backend& backend, const ScanResult& result) {
  SessionInfo& info = writer.info();
  info.simulated_s = result.simulated_s;
  if (backend.clock().real_time()) info.clock_end = read_clock_pair(backend.clock());
  info.counts.insert(result.counts.begin(), result.counts.end());
  info.account = result.account;
  backend.end_wire_record();
  for (const Statistic& s : backend.statistics()) info.devices[s.name] = s.value;
  for (const Statistic& s : result.sync) info.devices[s.name] = s.value;
  keep_timing(writer, rig, result);
}

/// Of each camera that lost frames how many and why; one line for those that lost none.
void tell_frames(const SessionInfo& info, Progress& progress) {
  std::string whole;
  for (const auto& [camera, account] : info.account) {
    if (!lost_nothing(info.counts, camera, account))
      progress.warn("camera " + camera + ": " + account_line(info.counts, camera, account));
    else
      whole += (whole.empty() ? "" : ", ") + camera + " " + std::to_string(info.counts.at(camera + ".recorded"));
  }
  if (!whole.empty()) progress.note("frames recorded, none lost: " + whole);
}

/// Where what failed has been told of, most likely the disk.
template <class Keep>
void as_far_as_possible(Keep keep) {
  try {
    keep();
  } catch (const NotOnDisk&) {
    throw;
  } catch (const std::exception&) {
  }
}

}  // namespace

void check_lux(const std::string& lux) {
  if (lux == "auto") return;
  double value = 0;
  if (!parse_number(lux, value) || !holds(kLuxRange, value))
    throw InputError("--lux: found '" + shown_text(lux) + "', expected auto or " + in_words(kLuxRange));
}

fs::path default_session(std::string rig) {
  const auto no_file_name = [](char c) { return c == '/' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  std::replace_if(rig.begin(), rig.end(), no_file_name, '_');
  if (rig.starts_with('.')) rig.front() = '_';
  std::string stamp = utc_now();
  std::erase_if(stamp, [](char c) { return c == '-' || c == ':'; });
  const fs::path base = fs::path("sessions") / (rig + "-" + stamp);
  fs::path path = base;
  for (int n = 2; fs::exists(path); ++n) path = base.string() + "-" + std::to_string(n);
  return path;
}

Recording record_session(const ScanOptions& options, const RigConfig& rig, const PipelineParameters* parameters,
                         const ScanPlan& plan, Backend& backend, const fs::path& path, const std::string& commission,
                         Progress& progress, Motion& motion) {
  SessionInfo info = session_info_of(options, rig, backend, path);
  info.commission = commission;
  const bool meter = options.lux == "auto" && rig.scan.capture.read_lux;
  if (meter || options.lux != "auto") {
    info.lux_source = meter ? "meter" : "hand";
    info.lux_before = meter ? read_lux(backend) : std::stod(options.lux);
    if (meter && rig.scan.capture.lux_accuracy > 0)
      info.lux_uncertainty = rig.scan.capture.lux_accuracy * *info.lux_before;
    show_lux(*info.lux_before, info.lux_source);
  }
  const std::string mesh = rig.object.mesh.filename().string();
  RigConfig as_used = rig;
  if (rig.calibration) as_used.calibration_sha256 = sha256_of_text(rig.calibration->text);
  const std::string rig_file = resolved_rig_yaml(as_used, mesh);
  info.rig_hash = sha256_of_text(rig_file);
  describe_for_recording(rig, info);
  SessionWriterOptions writer_options;
  writer_options.wait_when_full = !backend.clock().real_time();
  SessionWriter writer(path, std::move(info), writer_options);
  writer.add_file(rig.object.mesh, mesh);
  writer.add_text("rig.yaml", rig_file);
  writer.add_text("plan.csv", plan_csv(plan));
  keep_calibration(rig, writer);

  fs::create_directory(path / "cameras");
  for (const RigCamera& camera : rig.cameras) write_camera_files(path / "cameras", camera.model, camera.name);

  backend.record_wire(path);
  PlayedFaults faults(backend, writer, options.faults);
  const bool real_time = backend.clock().real_time();
  LiveView live(path, rig, parameters, real_time, progress);
  SessionSink sink(writer, live, faults, progress, plan.segments().back().name, options.on_frame);
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
              [&](const ScanProgress& p) { live.show(p); },
              [&](const std::string& what) { progress.cut(what); }};
  const auto pictures = [&] {
    return PictureOptions{[&](double fraction) { progress.update("writing pictures", fraction); },
                          StopOnSignal::from_now_on()};
  };
  ScanResult& result = job.result;
  try {
    motion.run(job);
  } catch (const std::exception& e) {
    if (result.status.empty()) result.status = std::string("stopped: ") + e.what();
    progress.warn(result.status + "; closing the session");
    as_far_as_possible([&] { keep_figures(writer, rig, backend, result); });
    as_far_as_possible([&] { writer.close(result.status, pictures()); });
    tell_frames(writer.info(), progress);
    throw;
  }
  Recording recording;
  recording.parked = std::chrono::steady_clock::now();
  keep_figures(writer, rig, backend, result);
  for (const std::string& fault : faults.never_began()) {
    progress.warn("faults: " + fault + ": never began");
    writer.event(backend.clock().now(), event_kind::kInjected, fault + " never began");
  }
  if (meter && result.complete()) try {
      writer.info().lux_after = read_lux(backend);
    } catch (const InputError& e) {
      progress.warn(e.what());
      writer.event(backend.clock().now(), event_kind::kFault, e.what());
    }
  progress.update("closing the session", 0);
  recording.live = live.end();
  if (real_time && result.complete() && recording.live) recording.unwritten = recording.live->pictures();
  const auto none = [] { return PictureOptions{.stop = [] { return true; }}; };
  writer.close(result.status, recording.unwritten.empty() ? pictures() : none());
  write_checksums(path);
  tell_frames(writer.info(), progress);
  for (const auto& [name, count] : writer.info().counts) result.counts[name] = count;
  result.account = writer.info().account;
  recording.result = std::move(result);
  return recording;
}

}  // namespace tankrig::app
