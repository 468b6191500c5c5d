// The rig in this process: mock devices on the simulated tank, under the virtual clock.
#include "apps/tankrig/devices/backend.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "core/settings_table.hpp"
#include "drivers/arm/backlash_arm.hpp"
#include "sim_backends/faults/faulty_arm.hpp"
#include "sim_backends/faults/faulty_camera.hpp"
#include "sim_backends/faults/faulty_laser.hpp"
#include "sim_backends/faults/faulty_lux_meter.hpp"
#include "sim_backends/mock/mock_arm.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/mock/mock_lux_meter.hpp"
#include "sim_backends/world/scene.hpp"

namespace tankrig::app {
namespace {

sim::FaultPlan read_plan(const std::filesystem::path& file, const RigConfig& rig) {
  if (file.empty()) return {};
  return sim::FaultPlan::load(file, sim::FaultLevel::kMock, camera_names(rig));
}

/// In-process devices on the simulated tank, under the virtual clock, with the faults of a plan before them.
class MockBackend final : public Backend {
 public:
  MockBackend(const RigConfig& rig, const BackendOptions& options)
      : world_(load_world(rig, options.world)),
        render_(options.render),
        script_(read_plan(options.faults, rig)),
        parameters_(read_parameters(rig)),
        arm_(world_.arm(), parameters_.arm, rig.scan.park, clock_),
        faulty_arm_(arm_, script_, clock_),
        links_(faulty_arm_, world_.arm(), rig.backlash_ticks),
        laser_(parameters_.laser_warm_up, clock_),
        faulty_laser_(laser_, script_, clock_),
        lux_meter_([this] { return world_.lux(); }, clock_, parameters_.lux_relative_noise, options.world.seed),
        faulty_lux_meter_(lux_meter_, script_, clock_) {
    script_.mark(sim::FaultOrigin::kStart, clock_.now());
    for (const RigCamera& camera : rig.cameras) {
      if (!options.need.only_camera.empty() && camera.name != options.need.only_camera) continue;
      cameras_.push_back(make_camera(rig, camera));
      faulty_cameras_.push_back(std::make_unique<sim::FaultyCamera>(*cameras_.back(), script_, clock_));
    }
    warnings_ = scene_warnings(rig, world_);
  }

  std::vector<std::string> warnings() const override { return warnings_; }

  Clock& clock() override { return clock_; }
  Arm& arm() override { return links_; }
  Laser& laser() override { return faulty_laser_; }
  LuxMeter& lux_meter() override { return faulty_lux_meter_; }
  bool interlock_closed() const override { return true; }  // nobody stands in the simulated beam
  std::string noise() const override { return world_.noise_description(); }
  sim::FaultScript* faults() override { return script_.plan().faults.empty() ? nullptr : &script_; }
  const sim::TankWorld* world() const override { return &world_; }
  std::vector<Camera*> cameras() override {
    std::vector<Camera*> out;
    for (const auto& camera : faulty_cameras_) out.push_back(camera.get());
    return out;
  }

 private:
  static sim::MockParameters read_parameters(const RigConfig& rig) {
    const auto section = rig.section("mock");
    return section ? settings_from(*section, sim::kMockKeys) : sim::MockParameters{};
  }

  std::unique_ptr<sim::MockCamera> make_camera(const RigConfig& rig, const RigCamera& camera) {
    const sim::CameraSpec& seen = scene_camera(rig, camera, world_);
    sim::MockCameraParameters parameters = parameters_.camera;
    parameters.exposure = from_seconds(seen.exposure_s);
    parameters.stamp_offset += world_.latency();
    parameters.triggered = camera.trigger.mode != TriggerMode::kFree;
    return std::make_unique<sim::MockCamera>(
        CameraInfo{camera.name, camera.model.width, camera.model.height, seen.channels, camera.rate_hz}, parameters,
        clock_, arm_, laser_, [this](const std::string& name, const sim::Exposure& exposure) {
          return render_ ? render_(world_, name, exposure) : world_.render(name, exposure);
        });
  }

  sim::TankWorld world_;
  decltype(BackendOptions::render) render_;
  sim::FaultScript script_;
  VirtualClock clock_;
  sim::MockParameters parameters_;
  sim::MockArm arm_;
  sim::FaultyArm faulty_arm_;
  BacklashArm links_;
  sim::MockLaser laser_;
  sim::FaultyLaser faulty_laser_;
  sim::MockLuxMeter lux_meter_;
  sim::FaultyLuxMeter faulty_lux_meter_;
  std::vector<std::unique_ptr<sim::MockCamera>> cameras_;
  std::vector<std::unique_ptr<sim::FaultyCamera>> faulty_cameras_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::unique_ptr<Backend> make_mock_backend(const RigConfig& rig, const BackendOptions& options) {
  const SafetySettings& safety = rig.scan.safety;
  if (safety.heartbeat_output.kind != HeartbeatKind::kNone || safety.enable_input.kind != EnableKind::kNone ||
      safety.warning_output.kind != WarningKind::kNone)
    throw InputError(rig.file,
                     "scan: safety: heartbeat_output, enable_input, warning_output: found on a simulated rig, "
                     "expected kind none: it has no lines");
  return std::make_unique<MockBackend>(rig, options);
}

}  // namespace tankrig::app
