#include "tests/scenarios/wire_rig.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <string_view>

#include "core/input_error.hpp"
#include "drivers/arm/arm5e.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/can/open_can.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "drivers/lux/open_lux_meter.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/guardian/guardian_process.hpp"
#include "rig/scan/scan_log.hpp"
#include "session/recording/session_writer.hpp"
#include "sim_backends/faults/picture_faults.hpp"
#include "tests/scenarios/faulty_session.hpp"

namespace tankrig::scenarios {
namespace {

using namespace std::chrono_literals;

constexpr Duration kWarmUp = 200ms;
constexpr int kWidth = 320, kHeight = 240;
constexpr int kArmOnTheBus = 0;  // it is the first there

constexpr char kBox[] = "box";

// As in a rig file.
constexpr char kDevices[] = R"(
arm:
  driver: arm5e
  carrier: can
  can: {interface: "unix:runtime/arm.can", bitrate_bit_s: 1000000, exchange_rate_hz: 200}
  serial: {device: runtime/arm, exchange_rate_hz: 75}
camera: {address: 127.0.0.1, pixel_format: Mono8, exposure_us: 10000, packet_size_bytes: 9000, socket: datagram}
laser: {device: runtime/laser, status_query: 3, warm_up_s: 0.2}
lux_meter: {driver: pce174, device: runtime/lux}
)";

ConfigNode devices_at(const std::filesystem::path& runtime) {
  const std::filesystem::path file = runtime / "devices.yaml";
  if (!std::filesystem::exists(file)) std::ofstream(file) << kDevices;
  return ConfigNode::load(file);
}

/// About five seconds.
ScanSettings short_scan() {
  ScanSettings s;
  s.park << 0, 0.12, 1.3, 0, 0.1;
  s.posture << 0, 0.12, 0, 0, 0.1;
  s.sweep.from = 1.35;
  s.sweep.to = 1.6;
  s.capture.dark_frames = 5;
  s.move.settle = 0.2;
  s.capture.laser_warm_up = seconds(kWarmUp);
  s.capture.camera_lead = 0.3;
  s.real_time.required = false;
  s.real_time.overruns = 0;  // how late a busy machine's cycles are is not what is measured here
  return s;
}

std::size_t hash_of(const cv::Mat& picture) {
  const cv::Mat whole = picture.isContinuous() ? picture : picture.clone();
  return std::hash<std::string_view>{}({whole.ptr<char>(), whole.total() * whole.elemSize()});
}

}  // namespace

EmulatedRig::EmulatedRig(const std::filesystem::path& runtime, const sim::FaultPlan& plan)
    : script_(plan), laser_(kWarmUp, clock_) {
  const ConfigNode devices = devices_at(runtime);
  pictures_ = std::make_unique<sim::PictureFaults>("mono", script_);
  hub_ = std::make_unique<sim::CanHub>(sim::CanHubSettings{.path = runtime / "arm.can", .bitrate = 1'000'000});
  sim::ArmEmulatorParameters parameters;
  parameters.power_up << 0, 0.12, 1.3, 0, 0.1;
  parameters.can_bitrate = 1'000'000;
  parameters.watchdog = 0s;
  arm_ = std::make_unique<sim::ArmEmulator>(arm5e(), parameters, clock_);
  CanSettings can;
  can.interface = "unix:" + (runtime / "arm.can").string();
  can.bitrate = parameters.can_bitrate;
  can.filters = parameters.can_ids.host_filters();
  arm_->serve(open_can(can, clock_));
  arm_->serve(runtime / "arm");
  save_arm_zero(runtime / "zero.yaml", {arm_->true_zero(), "emulated"});
  sim::RelayEmulatorSettings relay = sim::relay_emulator_settings_from(devices.child("laser"), nullptr, runtime);
  relay.watchdog = 0s;
  relay_ = std::make_unique<sim::RelayEmulator>(relay, laser_);
  const auto feed = [this](bool closed) {
    arm_->set_fed(closed);
    relay_->set_fed(closed);
  };
  feed(false);
  box_ =
      std::make_unique<sim::BoxEmulator>(sim::BoxEmulatorSettings{.name = runtime / kBox, .reset_after = 50ms}, feed);
  lux_ =
      std::make_unique<sim::LuxEmulator>(sim::lux_emulator_settings_from(devices.child("lux_meter"), nullptr, runtime),
                                         [this] { return sim::spoilt_lux(script_, kLux, clock_.now(), last_lux_); });
  sim::GigeCameraSettings gige;
  gige.serial = "EMU-mono";
  gige.width = kWidth;
  gige.height = kHeight;
  camera_ = std::make_unique<sim::GigeCameraEmulator>(gige, [this](std::uint64_t index, Stamp begin,
                                                                   Duration exposure) {
    const Stamp now = clock_.now();
    if (const sim::FaultSpec* late = script_.active(sim::FaultDevice::kCamera, sim::FaultKind::kDelayed, now, "mono"))
      clock_.sleep_until(now + late->delay);
    const Stamp middle = begin + exposure / 2;
    cv::Mat picture = pictures_->spoilt(stripe_picture({kWidth, kHeight}, laser_.power_at(middle), index), index, now);
    const std::lock_guard lock(mutex_);
    if (const auto [known, fresh] = exposed_.try_emplace(hash_of(picture), middle); !fresh) known->second.reset();
    return picture;
  });
  script_.mark(sim::FaultOrigin::kStart, clock_.now());
  faults_ = std::make_unique<sim::WireFaults>(
      script_,
      sim::WireDevices{arm_.get(), hub_.get(), &laser_, relay_.get(), lux_.get(), {{"mono", camera_.get()}}, {}});
}

EmulatedRig::~EmulatedRig() = default;

void EmulatedRig::pull_lines() {
  hub_->cut(kArmOnTheBus, true);
  arm_->unplug();
  relay_->unplug();
}

void EmulatedRig::plug_lines() {
  hub_->cut(kArmOnTheBus, false);
  arm_->plug();
  relay_->plug();
}

std::optional<Stamp> EmulatedRig::exposed(const cv::Mat& picture) const {
  const std::lock_guard lock(mutex_);
  const auto found = exposed_.find(hash_of(picture));
  return found == exposed_.end() ? std::nullopt : found->second;
}

GuardianSettings guardian_settings(const std::filesystem::path& runtime, const std::string& carrier) {
  const ConfigNode devices = devices_at(runtime);
  const RelayLaserSettings laser = relay_laser_settings_from(devices.child("laser"), runtime);
  GuardianSettings s;
  s.laser_line = laser.serial;
  s.laser = laser.protocol;
  s.arm = arm5e_settings_from(devices.child("arm"), runtime, carrier);
  s.command = "scan";
  s.report = runtime / "report";
  return s;
}

Outcome scan_wire(const std::filesystem::path& runtime, const std::string& carrier,
                  const std::filesystem::path& session, EmulatedRig* rig, bool guarded) {
  Outcome out;
  MonotonicClock clock;
  const ConfigNode devices = devices_at(runtime);
  RelayLaserSettings laser_settings = relay_laser_settings_from(devices.child("laser"), runtime);
  Arm5eSettings arm_settings = arm5e_settings_from(devices.child("arm"), runtime, carrier);
  std::optional<GuardianProcess> guardian;
  if (guarded) {
    guardian.emplace(std::vector<std::string>{"guardian", runtime.string(), carrier});
    std::ofstream(runtime / "guardian.pid") << guardian->process();
    laser_settings.serial.opened = guardian->line(GuardianLine::kLaser);
    arm_settings.serial.opened = guardian->line(GuardianLine::kArm);
  }
  RelayLaser relay(laser_settings);
  const auto driver = open_arm5e(arm_settings, arm5e(), clock);
  if (guardian) {
    relay.set_veto(guardian->taken_over());
    driver->set_veto(guardian->taken_over());
    guardian->wait_until_ready();
  }
  WatchdogBox box(
      {.heartbeat = {.kind = HeartbeatKind::kBytes, .device = runtime / kBox}, .enable = {.kind = EnableKind::kReply}},
      runtime, clock);
  driver->set_zero(load_arm_zero(runtime / "zero.yaml"));
  AravisCamera mono(aravis_settings_from(devices.child("camera"), {"mono", kWidth, kHeight, 1, 25}));
  const auto lux_meter = open_lux_meter(devices.child("lux_meter"), runtime);

  CallTape tape(clock);
  TapedArm arm(*driver, tape);
  TapedLaser laser(relay, tape);
  TapedCamera camera(mono, tape);
  const ScanSettings s = short_scan();
  const ScanPlan plan = make_scan_plan(s, read_posture(*driver, clock, 2s));
  SessionInfo info;
  info.cameras.push_back({});
  info.cameras[0].name = "mono";
  info.cameras[0].model.width = kWidth;
  info.cameras[0].model.height = kHeight;
  info.cameras[0].model.fx = info.cameras[0].model.fy = kWidth;
  SessionWriterOptions options;
  options.wait_when_full = false;
  SessionWriter writer(session, info, options);
  sim::FaultScript healthy({});
  FaultySession sink(writer, rig ? rig->script() : healthy, clock, tape, out);
  sink.look = [&](const FrameRecord& frame, const cv::Mat& picture) {
    if (const auto exposed = rig ? rig->exposed(picture) : std::nullopt)
      out.stamp_error = std::max(out.stamp_error.value_or(Duration{}), std::chrono::abs(frame.stamp - *exposed));
  };
  const std::atomic<bool> stop{false};
  ScanJob job{plan,
              s,
              clock,
              arm,
              laser,
              {{&camera, RecordWhen::kAll, [](const JointVector&) { return true; }}},
              sink,
              stop,
              [&] {
                sink.round();
                return relay.interlock_closed().value_or(false);
              }};
  job.step_watch = guardian ? &*guardian : nullptr;
  job.box = &box;
  try {
    const ScanResult result = run_scan(job);
    out.status = result.status;
  } catch (const std::exception& e) {
    out.status = std::string("stopped: ") + e.what();
  }
  if (rig) out.moving = rig->arm().true_velocity_at(clock.now()).cwiseAbs().maxCoeff();
  out.counts = job.result.counts;
  out.account = job.result.account;
  out.left = job.result.left;
  const auto lux = lux_meter->read(1s);
  out.lux = lux.ok() ? std::to_string(lux.value().lux) : describe(lux.error());
  if (!lux.ok()) sink.event(clock.now(), "fault", out.lux);
  writer.info().counts.insert(out.counts.begin(), out.counts.end());
  writer.info().account = out.account;
  writer.close(out.status);
  out.counts = writer.info().counts;
  out.account = writer.info().account;
  if (!rig || rig->script().plan().faults.empty()) return out;
  const auto begun = rig->script().begin(0);
  out.has_begun = begun && *begun <= clock.now();
  if (out.has_begun) out.begun = *begun;
  std::optional<Stamp> noticed;
  for (const TimedText& e : out.events)
    if (!noticed && (e.kind == "fault" || e.kind == "stop") && out.stopped()) noticed = e.when;
  if (out.stopped() && out.has_begun) out.reaction = reaction(tape.entries(), out.begun, noticed);
  return out;
}

}  // namespace tankrig::scenarios
