// Which emulators a rig file asks for.
#include <algorithm>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/device_path.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "sim_backends/wire/emulated_tank.hpp"
#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {
namespace {

constexpr int kMovedSinceHomed = 1000;  // an encoder near 0 proves nothing to the driver
constexpr char kRuntime[] = "runtime/", kBus[] = "unix:";

/// Is it a line of ours to make?
bool is_emulated(const ConfigNode& node, const char* key) { return node.text_or(key, "").starts_with(kRuntime); }

/// `emulation: arm:`, which says more than how it behaves.
struct EmulatedArmKeys : EmulatedArm {
  bool homed = false;
};
const Setting<EmulatedArmKeys> kEmulatedArmRows[] = {
    {"homed", &EmulatedArmKeys::homed, "as after `tankrig arm home`"},
    {"can_interface", &EmulatedArmKeys::can_interface, "the emulator's end of a kernel's bus"},
    {"", &EmulatedArmKeys::parameters, kArmEmulatorKeys},
};
constexpr SettingsTable<EmulatedArmKeys> kEmulatedArm{kEmulatedArmRows};

const Setting<GigeCameraSettings> kGigeRows[] = {
    {"clock_drift_ppm", &GigeCameraSettings::clock_drift_ppm, ConfigRange(-1000, 1000),
     "every camera's clock runs fast by this"},
    {"timestamp_latch", &GigeCameraSettings::timestamp_latch,
     "answers the timestamp latch; without it the latched value never changes"},
};
constexpr SettingsTable<GigeCameraSettings> kGige{kGigeRows};

EmulatedArm arm_from(const ConfigNode& node, const std::optional<ConfigNode>& behaviour,
                     const std::filesystem::path& runtime) {
  const Arm5eSettings driver = arm5e_settings_from(node, runtime);
  EmulatedArmKeys arm;
  if (behaviour) read_settings(*behaviour, kEmulatedArm, arm);
  arm.parameters.can_ids = driver.can_ids;
  if (node.has("can")) {
    arm.parameters.can_bitrate = driver.can.bitrate;
    if (driver.can.interface.starts_with(kBus))
      arm.hub = CanHubSettings{.path = driver.can.interface.substr(sizeof kBus - 1), .bitrate = driver.can.bitrate};
  }
  if (const auto serial = node.optional_child("serial"); serial && is_emulated(*serial, "device")) {
    arm.parameters.serial_baud = driver.serial.baud;
    arm.line = driver.serial.device;
  }
  if (arm.homed) {
    if (!is_emulated(node, "zero_file")) behaviour->fail("homed", "expected a zero_file that begins with runtime/");
    arm.zero_file = driver.zero_file;
    if (!behaviour->has("power_up_ticks")) arm.parameters.power_up_ticks.fill(kMovedSinceHomed);
  }
  return arm;
}

GigeCameraSettings camera_from(const ConfigNode& node, const CameraSpec& seen,
                               const std::optional<ConfigNode>& behaviour) {
  const AravisSettings driver =
      aravis_settings_from(node, {seen.name, seen.model.width, seen.model.height, seen.channels, seen.rate_hz});
  GigeCameraSettings gige;
  gige.address = driver.address;
  gige.serial = driver.serial.empty() ? "EMU-" + seen.name : driver.serial;
  gige.user_id = seen.name;
  gige.width = seen.model.width;
  gige.height = seen.model.height;
  gige.rate_hz = seen.rate_hz;
  gige.exposure_us = driver.exposure_us;
  if (!driver.pixel_format.empty()) gige.pixel_format = driver.pixel_format;
  if (behaviour) read_settings(*behaviour, kGige, gige);
  return gige;
}

V4l2OutputSettings output_from(const ConfigNode& node, const CameraSpec& seen) {
  V4l2OutputSettings output = settings_from(node, kV4l2OutputKeys);
  output.width = seen.model.width;
  output.height = seen.model.height;
  output.rate_hz = seen.rate_hz;
  output.exposure = from_seconds(seen.exposure_s);
  return output;
}

}  // namespace

bool needs_private_network(const ConfigNode& devices) {
  const auto cameras = devices.optional_child("cameras");
  if (!cameras) return false;
  const std::vector<std::string> names = cameras->keys();
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return cameras->child(name).text_or("driver", "") == "aravis"; });
}

EmulatedTankSettings emulated_tank_settings_from(const ConfigNode& devices, const std::optional<ConfigNode>& emulation,
                                                 const TankWorld& world, const std::filesystem::path& runtime,
                                                 const HeartbeatOutput& heartbeat) {
  const auto behaviour = [&](const char* device) {
    return emulation ? emulation->optional_child(device) : std::optional<ConfigNode>();
  };
  EmulatedTankSettings s;
  if (const auto arm = devices.optional_child("arm")) s.arm = arm_from(*arm, behaviour("arm"), runtime);
  if (const auto cameras = devices.optional_child("cameras"))
    for (const CameraSpec& seen : world.cameras())
      if (const auto node = cameras->optional_child(seen.name); node && node->text("driver") == "aravis")
        s.cameras.push_back(camera_from(*node, seen, behaviour("cameras")));
  if (const auto outputs = behaviour("v4l2_outputs"))
    for (const CameraSpec& seen : world.cameras())
      if (const auto node = outputs->optional_child(seen.name))
        s.video_outputs.push_back({seen.name, output_from(*node, seen)});
  if (const auto laser = devices.optional_child("laser"); laser && is_emulated(*laser, "device")) {
    const auto b = behaviour("laser");
    s.laser = relay_emulator_settings_from(*laser, b ? &*b : nullptr, runtime);
    s.laser_warm_up = relay_laser_settings_from(*laser, runtime).warm_up;
  }
  if (const auto lux = devices.optional_child("lux_meter"); lux && is_emulated(*lux, "device")) {
    const auto b = behaviour("lux_meter");
    s.lux = lux_emulator_settings_from(*lux, b ? &*b : nullptr, runtime);
  }
  if (heartbeat.kind == HeartbeatKind::kBytes && heartbeat.device.starts_with(kRuntime)) {
    s.box.emplace();
    if (const auto b = behaviour("box")) read_settings(*b, kBoxEmulatorKeys, *s.box);
    s.box->name = device_path(heartbeat.device, runtime);
  }
  if (s.laser || s.box) s.hand = hand_at(runtime);
  if (emulation) emulation->finish();
  return s;
}

std::filesystem::path hand_at(const std::filesystem::path& runtime) { return runtime / "hand"; }

std::string emulation_key_rows() {
  return settings_rows("emulation.arm", kEmulatedArm) + settings_rows("emulation.cameras", kGige) +
         settings_rows("emulation.v4l2_outputs.CAMERA", kV4l2OutputKeys) +
         settings_rows("emulation.laser", kRelayEmulatorKeys) + settings_rows("emulation.box", kBoxEmulatorKeys) +
         settings_rows("emulation.lux_meter", kLuxEmulatorKeys);
}

}  // namespace tankrig::sim
