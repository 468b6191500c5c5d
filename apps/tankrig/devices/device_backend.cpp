// The rig behind its drivers: real devices, or emulated ones on the same wires, in real time.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "apps/tankrig/command_line/waiting.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "apps/tankrig/devices/camera_info.hpp"
#include "apps/tankrig/devices/emulation_process.hpp"
#include "apps/tankrig/devices/guarded.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "drivers/arm/arm5e.hpp"
#include "drivers/arm/backlash_arm.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/v4l2_camera.hpp"
#include "drivers/can/can_recorder.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "drivers/lux/open_lux_meter.hpp"
#include "rig/guardian/guardian_process.hpp"
#include "rig/scan/before_start.hpp"
#include "sim_backends/wire/emulated_tank.hpp"
#include "sim_backends/wire/private_network.hpp"

namespace tankrig::app {
namespace {

ConfigNode devices_of(const RigConfig& rig) {
  const auto devices = rig.section("devices");
  if (!devices) throw InputError(rig.file, "devices: found nothing, expected arm, cameras, laser and lux_meter");
  return *devices;
}

/// The emulated devices of a rig that has them: those of a running `tankrig emulate`, or our own.
class Emulation {
 public:
  Emulation(const RigConfig& rig, const BackendOptions& options) {
    const char* running = std::getenv(kRuntimeVariable);
    if (!options.faults.empty() && (running || !rig.section("emulation")))
      throw InputError(running ? "--faults: the devices are being emulated already, give it to `tankrig emulate`"
                               : "--faults: these devices are real, expected a rig with a section `emulation`");
    if (!options.faults.empty())  // errors told here, not by the process that plays it
      (void)sim::FaultPlan::load(options.faults, sim::FaultLevel::kWire, camera_names(rig));
    if (running) {
      runtime_ = running;
    } else if (rig.section("emulation") && options.need.cameras && sim::needs_private_network(devices_of(rig))) {
      if (const Status entered = sim::enter_private_network(); !entered)
        throw InputError(rig.file, std::string("emulation: ") + entered.error().where + ": " +
                                       std::strerror(entered.error().os_errno));
    }
    if (!runtime_.empty() && !std::filesystem::is_directory(runtime_))
      throw InputError(std::string(kRuntimeVariable) + ": found '" + runtime_.string() +
                       "', expected the folder of a running `tankrig emulate`");
    if (!rig.section("emulation")) return;
    if (rig.scene.empty()) throw InputError(rig.file, "scene: found nothing, expected the scene to emulate");
    world_.emplace(load_world(rig, options.world));
    if (!runtime_.empty()) return;
    (void)sim::emulated_tank_settings_from(devices_of(rig), rig.section("emulation"), *world_, "/",
                                           rig.scan.safety.heartbeat_output);  // errors told here
    process_.emplace(rig, options);
    runtime_ = process_->runtime();
  }

  const std::filesystem::path& runtime() const { return runtime_; }
  const sim::TankWorld* world() const { return world_ ? &*world_ : nullptr; }

 private:
  std::filesystem::path runtime_;
  std::optional<EmulationProcess> process_;
  std::optional<sim::TankWorld> world_;
};

/// A camera that the cycle triggers is set to software trigger, whether its device section says so or not.
AravisSettings aravis_settings_of(const RigCamera& camera, const ConfigNode& node, const CameraInfo& info) {
  AravisSettings settings = aravis_settings_from(node, info);
  if (camera.trigger.mode == TriggerMode::kFree) return settings;
  if (node.has("trigger") && settings.trigger != "software")
    node.fail("trigger", "found " + settings.trigger + ", expected software: camera " + camera.name +
                             " is triggered by the cycle");
  settings.trigger = "software";
  return settings;
}

std::unique_ptr<Camera> open_camera(const RigCamera& camera, const CameraInfo& info, const ConfigNode& node,
                                    std::vector<std::string>& warnings) {
  if (node.choice("driver", {"aravis", "v4l2"}) == "aravis")
    return std::make_unique<AravisCamera>(aravis_settings_of(camera, node, info));
  if (camera.trigger.mode != TriggerMode::kFree)
    node.fail("driver",
              "found v4l2 for a camera with a trigger, expected aravis: Video for Linux has no software trigger");
  V4l2CameraSettings settings = v4l2_settings_from(node, camera.name, info.channels);
  settings.width = info.width;
  settings.height = info.height;
  settings.rate_hz = info.rate_hz;
  auto opened = std::make_unique<V4l2Camera>(settings);
  for (const std::string& warning : opened->warnings()) warnings.push_back("camera " + camera.name + ": " + warning);
  return opened;
}

sim::HandDeed hand_deed(Deed deed) {
  switch (deed) {
    case Deed::kOpenLid:
      return sim::HandDeed::kOpenLid;
    case Deed::kCloseLid:
      return sim::HandDeed::kCloseLid;
    case Deed::kPressStop:
      return sim::HandDeed::kPressStop;
    case Deed::kReleaseStop:
      break;
  }
  return sim::HandDeed::kReleaseStop;
}

constexpr Duration kGuardianEnds = std::chrono::seconds{5};  // usually within one

/// Unless another program is at it, the laser first: it is off from here on, whatever else cannot be opened.
class DeviceBackend final : public Backend {
 public:
  DeviceBackend(const RigConfig& rig, const BackendOptions& options)
      : emulation_(rig, options), devices_(devices_of(rig)) {
    const auto open = [&](const std::string& device, auto opening) {
      const Waiting told("devices." + device + " to answer");
      try {
        return opening();
      } catch (const InputError& e) {
        throw InputError(rig.file, "devices." + device + ": " + e.what());
      }
    };
    const std::filesystem::path& runtime = emulation_.runtime();
    const Need& need = options.need;
    if (need.arm) {
      const ConfigNode arm = devices_.child("arm");
      arm.choice("driver", {"arm5e"});
      arm_settings_ = arm5e_settings_from(arm, runtime, options.carrier);
      tell_guardian_report(rig);
      check_nobody_moves(arm_settings_.zero_file);  // the laser is that program's too
      if (need.laser) start_guardian(rig, options);
    }
    std::optional<RelayLaserSettings> laser_settings;
    if (need.laser || devices_.has("laser")) {
      const ConfigNode laser = devices_.child("laser");
      laser.choice("driver", {"relay"});
      laser_settings = relay_laser_settings_from(laser, runtime);
      wired_interlock_ = laser_settings->interlock == InterlockSight::kWired;
      if (!wired_interlock_ && !laser_settings->protocol.status_query)
        laser.fail("interlock", "found read without a status_query, expected one, or wired");
      if (guardian_) laser_settings->serial.opened = guardian_->line(GuardianLine::kLaser);
      try {
        laser_ = open("laser", [&] { return std::make_unique<RelayLaser>(*laser_settings, clock_); });
      } catch (const InputError& e) {
        if (need.laser) throw;
        laser_unknown_ = std::string("the laser's state is not known, it may be on: ") + e.what();
      }
    }
    if (need.arm) {
      if (laser_settings) check_goes_off_first(devices_.child("laser"), *laser_settings, arm_settings_.watchdog);
      if (guardian_) arm_settings_.serial.opened = guardian_->line(GuardianLine::kArm);
      arm_ = open("arm", [&] { return open_arm5e(arm_settings_, rig.arm, clock_); });
      links_.emplace(*arm_, rig.arm, rig.backlash_ticks);
    }
    if (guardian_) {
      laser_->set_veto(guardian_->taken_over());
      arm_->set_veto(guardian_->taken_over());
      const Waiting told("the guardian");
      guardian_->wait_until_ready();
    }
    const SafetySettings& safety = rig.scan.safety;
    const bool watched =
        safety.heartbeat_output.kind != HeartbeatKind::kNone || safety.enable_input.kind != EnableKind::kNone;
    if (need.arm && need.laser) try {
        const Waiting told("the watchdog box to answer");
        if (watched) box_.emplace(WatchdogSettings{safety.heartbeat_output, safety.enable_input}, runtime, clock_);
        if (watched) check_box_open(safety, *box_, clock_);
        warning_ = open_warning_line(safety.warning_output, runtime);
      } catch (const InputError& e) {
        throw InputError(rig.file, std::string("scan: ") + e.what());
      }
    if (need.cameras) {
      const ConfigNode cameras = devices_.child("cameras");
      for (const RigCamera& camera : rig.cameras)
        if (need.only_camera.empty() || camera.name == need.only_camera) {
          const Waiting told("camera " + camera.name + " to answer");
          cameras_.push_back(open_camera(camera, camera_info(rig, camera), cameras.child(camera.name), warnings_));
        }
    }
    const bool all = need.arm && need.cameras && need.only_camera.empty();
    if (all || need.lux_meter)
      if (const auto lux = devices_.optional_child("lux_meter")) lux_meter_ = open_lux_meter(*lux, runtime);
    if (all) devices_.finish();
    add_warnings(rig);
  }

  Clock& clock() override { return clock_; }
  Arm& arm() override { return links_.value(); }
  Arm5e* homed_arm() override { return arm_.get(); }
  StepWatch* step_watch() override { return guardian_ ? &*guardian_ : nullptr; }
  WarningLine* warning() override { return warning_.get(); }
  WatchdogBox* box() override { return box_ ? &*box_ : nullptr; }
  Laser& laser() override {
    if (!laser_) throw std::logic_error("the laser was not asked for");
    return *laser_;
  }
  LuxMeter& lux_meter() override { return lux_meter_ ? *lux_meter_ : no_lux_meter_; }
  std::string laser_unknown() const override { return laser_unknown_; }
  std::vector<Camera*> cameras() override {
    std::vector<Camera*> out;
    for (const auto& camera : cameras_) out.push_back(camera.get());
    return out;
  }
  std::vector<std::string> warnings() const override { return warnings_; }
  std::string noise() const override { return world() ? world()->noise_description() : "device"; }
  const sim::TankWorld* world() const override { return emulation_.world(); }

  bool interlock_closed() const override {
    if (!laser_ || wired_interlock_) return laser_ != nullptr;
    return laser_->interlock_closed().value_or(false);
  }

  bool reads_interlock() const override { return !wired_interlock_; }
  RelayProof* relay_proof() override { return laser_.get(); }
  bool does_by_hand(Deed deed) override {
    return world() && sim::ask_hand(sim::hand_at(emulation_.runtime()), hand_deed(deed));
  }

  void record_wire(const std::filesystem::path& session) override {
    if (arm_settings_.carrier == ArmCarrier::kCan)
      can_recorder_ = std::make_unique<CanRecorder>(arm_settings_.can, session / "can.log");
  }

  void end_wire_record() override {
    if (can_recorder_) can_recorder_->stop();
  }

  Statistics statistics() const override {
    Statistics all;
    const auto add = [&](const std::string& device, const Statistics& some) {
      for (const Statistic& s : some) all.push_back({device + "." + s.name, s.value});
    };
    if (arm_) add("arm", arm_->statistics());
    if (laser_) add("laser", laser_->statistics());
    if (box_) add("watchdog_box", box_->statistics());
    for (const auto& camera : cameras_) add(camera->info().name, camera->statistics());
    if (lux_meter_) add("lux_meter", lux_meter_->statistics());
    if (can_recorder_) {
      const CanRecorderCounters c = can_recorder_->counters();
      add("can_log", {{"recorded", double(c.recorded)},
                      {"receive_dropped", double(c.receive_dropped)},
                      {"lost_to_disk", double(c.lost_to_disk)},
                      {"write_errors", double(c.write_errors)}});
    }
    return all;
  }

 private:
  class NoLuxMeter final : public LuxMeter {
   public:
    Result<LuxReading> read(Duration) override { return Error{ErrorCode::kNotReady, 0, {}, "the rig file names none"}; }
  };

  void tell_guardian_report(const RigConfig& rig) const {
    const std::filesystem::path report = guardian_report(rig, arm_settings_.zero_file);
    {
      const Waiting told("an earlier command's guardian to confirm laser off and arm at rest");
      for (const Stamp end = clock_.now() + kGuardianEnds; guardian_at_work(report) && clock_.now() < end;)
        MonotonicClock{}.sleep_until(clock_.now() + std::chrono::milliseconds{10});
    }
    const std::string text = take_guardian_report(report, rig.file.string());
    if (!text.empty()) std::fprintf(stderr, "tankrig: an earlier command's guardian: %s\n", text.c_str());
  }

  void start_guardian(const RigConfig& rig, const BackendOptions& options) {
    std::vector<std::string> words{"guardian", "--rig", rig.file.string(), "--command", options.command};
    if (!options.carrier.empty()) words.insert(words.end(), {"--carrier", options.carrier});
    if (!emulation_.runtime().empty()) words.insert(words.end(), {"--runtime", emulation_.runtime().string()});
    guardian_.emplace(std::move(words));
  }

  void add_warnings(const RigConfig& rig) {
    if (wired_interlock_) warnings_.push_back("laser interlock is wired only: this program does not see it open");
    if (!world()) return;
    for (const std::string& warning : scene_warnings(rig, *world())) warnings_.push_back(warning);
  }

  MonotonicClock clock_;
  Emulation emulation_;
  ConfigNode devices_;
  bool wired_interlock_ = false;
  Arm5eSettings arm_settings_;
  std::optional<GuardianProcess> guardian_;  // before the drivers: it is told of lines that they open again
  std::optional<WatchdogBox> box_;
  std::unique_ptr<WarningLine> warning_;
  std::unique_ptr<RelayLaser> laser_;
  std::unique_ptr<Arm5e> arm_;
  std::optional<BacklashArm> links_;
  std::vector<std::unique_ptr<Camera>> cameras_;
  std::unique_ptr<LuxMeter> lux_meter_;
  NoLuxMeter no_lux_meter_;
  std::unique_ptr<CanRecorder> can_recorder_;
  std::vector<std::string> warnings_;
  std::string laser_unknown_;
};

}  // namespace

std::string device_key_rows() {
  return arm5e_rows("devices.arm") + settings_rows("devices.laser", kRelayKeys) + lux_meter_rows("devices.lux_meter") +
         settings_rows("devices.cameras.CAMERA", kDeviceCameraKeys) +
         settings_rows("devices.cameras.ARAVIS", kAravisKeys) + settings_rows("devices.cameras.V4L2", kV4l2Keys);
}

std::unique_ptr<Backend> make_device_backend(const RigConfig& rig, const BackendOptions& options) {
  return std::make_unique<DeviceBackend>(rig, options);
}

}  // namespace tankrig::app
