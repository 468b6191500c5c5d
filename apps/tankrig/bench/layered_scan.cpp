#include "apps/tankrig/bench/layered_scan.hpp"

#include <algorithm>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/bench/scan_trace.hpp"
#include "apps/tankrig/bench/scratch_folder.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "core/input_error.hpp"
#include "rig/capture/beam_view.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/scan/session_rig.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/event_kinds.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

class MemorySink final : public ScanSink {
 public:
  void joints(const JointState& state) override { states.push_back(state); }
  void frame(const FrameRecord& record, const cv::Mat&) override {
    frames.push_back(record);
    if (frames.back().file.empty())
      frames.back().file = "frames/" + record.camera + "/" + std::to_string(record.index) + ".png";
  }
  void event(Stamp when, std::string_view kind, const std::string& text) override {
    if (kind == event_kind::kPlan) plan_begin = when;
    if (kind == event_kind::kFault) faults.push_back(text);
  }

  std::vector<JointState> states;
  std::vector<FrameRecord> frames;
  std::vector<std::string> faults;
  std::optional<Stamp> plan_begin;
};

/// Through the text of its files and back, as a session that is opened: the same bits.
Session as_opened(SessionInfo info, const std::vector<FrameRecord>& frames) {
  const ScratchFolder scratch("tankrig-bench");
  const fs::path& folder = scratch.path();
  write_whole_file(folder / "session.yaml", session_yaml(info));
  std::string table = frames_header();
  for (const FrameRecord& frame : frames) table += frames_line(frame);
  write_whole_file(folder / "frames.csv", table);
  Session session;
  session.info = read_session_yaml(folder / "session.yaml");
  session.frames = read_frames_csv(folder / "frames.csv").records;
  session.path = "scan in memory";
  return session;
}

}  // namespace

LayeredScan::LayeredScan(const RigConfig& rig, const sim::WorldOptions& world, Progress& progress) {
  if (rig.backend != "mock")
    throw InputError(rig.file,
                     "backend: found '" + rig.backend + "', expected mock: a benchmark runs on a simulated rig");
  BackendOptions options;
  options.world = world;
  options.render = [this](const sim::TankWorld& tank, const std::string& camera, const sim::Exposure& exposure) {
    const auto layers = tank.layers(camera, exposure);
    layers_[{camera, exposure.index}] = layers;
    return tank.expose(*layers, tank.light());
  };
  backend_ = make_backend(rig, options);
  const ScanPlan plan = make_scan_plan(rig.scan, homed_posture(*backend_, rig.name));
  check_light(plan, rig.scan.safety);
  check_plan(rig, plan);

  MemorySink sink;
  std::vector<ScanCamera> cameras;
  const std::vector<Camera*> devices = backend_->cameras();
  for (std::size_t i = 0; i < devices.size(); ++i)
    cameras.push_back({devices[i], rig.cameras[i].record, stripe_in_view(rig, rig.cameras[i]), rig.cameras[i].trigger,
                       rig.cameras[i].time_offset});
  ScanJob job{plan,
              rig.scan,
              backend_->clock(),
              backend_->arm(),
              backend_->laser(),
              cameras,
              sink,
              StopOnSignal::requested(),
              [this] { return backend_->interlock_closed(); },
              [&](const ScanProgress& p) { progress.update("bench: scan", p.fraction); }};
  const ScanResult result = run_scan(job);
  if (!result.complete())
    throw InputError(rig.file, "scan " + result.status + (sink.faults.empty() ? "" : ": " + sink.faults.front()));

  SessionInfo info;
  info.name = rig.name;
  info.kind = "scan";
  info.status = result.status;
  info.software = TANKRIG_VERSION;
  info.noise = backend_->noise();
  info.seed = world.seed;
  info.light = backend_->world()->light();
  info.simulated_s = result.simulated_s;
  info.counts.insert(result.counts.begin(), result.counts.end());
  info.account = result.account;
  describe_for_recording(rig, info);
  session_ = as_opened(std::move(info), sink.frames);
  std::map<FrameKey, std::shared_ptr<const sim::FrameLayers>> kept;
  for (const FrameRecord& frame : session_.frames) {
    const FrameKey key{frame.camera, frame.sequence};
    kept[key] = layers_.at(key);
  }
  layers_ = std::move(kept);
  const double lux = backend_->world()->lux(), light = backend_->world()->light();
  if (light > 0) most_lux_ = lux / light;
  joints_ = std::move(sink.states);
  trace_ = trace_of_scan(rig, plan, sink.plan_begin.value_or(joints_.front().stamp), joints_, session_, lux);
  rig_yaml_ = resolved_rig_yaml(rig, session_.info.object->mesh);
}

double LayeredScan::light(const PictureConditions& conditions) const {
  if (conditions.lux) return *conditions.lux > 0 ? *conditions.lux / most_lux_ : 0;
  return conditions.light.value_or(backend_->world()->light());
}

std::optional<double> LayeredScan::lux(const PictureConditions& conditions) const {
  return light(conditions) * most_lux_;
}

cv::Mat LayeredScan::picture(const FrameRecord& frame, const PictureConditions& conditions) const {
  const sim::TankWorld& tank = *backend_->world();
  return tank.expose(*layers_.at({frame.camera, frame.sequence}), light(conditions), conditions.noise);
}

}  // namespace tankrig::app
