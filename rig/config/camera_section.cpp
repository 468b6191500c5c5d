#include "rig/config/camera_section.hpp"

#include <set>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

const Setting<TriggerSettings> kTriggerRows[] = {
    {"trigger", &TriggerSettings::mode,
     "free: at its own rate; software: at equal times; position: at equal angles of the sweep "
     "([triggers.md](triggers.md))",
     Need::kSparse},
    {"spacing_rad",
     &TriggerSettings::spacing,
     {1e-5, 1},
     "of `trigger: position`, required there; at the sweep's velocity at least a frame's time",
     Need::kSparse},
    {"trigger_delay_ms", &TriggerSettings::delay, ConfigRange(0, 1000),
     "from trigger to mid-exposure; none: measured as frames come"},
};
void check_trigger(const ConfigNode& node, const TriggerSettings& trigger) {
  const std::string found = std::string("found with trigger: ") + name_of(trigger.mode);
  if (trigger.mode == TriggerMode::kPosition && trigger.spacing == 0)
    node.fail("spacing_rad", "found nothing, expected it with trigger: position");
  if (trigger.mode != TriggerMode::kPosition && trigger.spacing != 0)
    node.fail("spacing_rad", found + ", expected it with trigger: position only");
  if (trigger.mode == TriggerMode::kFree && trigger.delay)
    node.fail("trigger_delay_ms", found + ", expected it with a trigger only");
}
constexpr SettingsTable<TriggerSettings> kTrigger{kTriggerRows, check_trigger};

void read_body(const ConfigNode& node, const char* key, RigCamera& camera) {
  const ConfigNode box = node.child(key);
  camera.body = {read_vector(box, "min_m"), read_vector(box, "max_m")};
  if (!(camera.body.sizes().minCoeff() > 0))
    box.fail("max_m", "found a side that is not positive, expected more than min_m");
}
void write_body(YAML::Emitter& out, const RigCamera& camera) {
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "min_m" << YAML::Value;
  emit_list(out, Vector3d(camera.body.min()));
  out << YAML::Key << "max_m" << YAML::Value;
  emit_list(out, Vector3d(camera.body.max()));
  out << YAML::EndMap;
}

const Setting<RigCamera> kRigCameraRows[] = {
    {"", kCalibratedCameraKeys},
    {"body",
     {read_body, write_body, "`min_m`, `max_m`"},
     "two corners, in c, of the box it takes up ([clearance.md](clearance.md))"},
    {"record", &RigCamera::record, "all of the scan, its dark blocks or its sweeps", Need::kRequired},
    {"rate_hz", &RigCamera::rate_hz, ConfigRange(0.1, 1000), "of its frames", Need::kRequired},
    {"", &RigCamera::trigger, kTrigger},
};

}  // namespace

constinit const SettingsTable<RigCamera> kRigCameraKeys{kRigCameraRows};

void check_cameras(const ConfigNode& root, const RigConfig& rig) {
  std::set<std::string> names;
  std::set<CameraRole> roles;
  const std::vector<ConfigNode> nodes = root.items("cameras");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    if (!names.insert(camera.name).second)
      nodes[i].fail("name", "found '" + shown_text(camera.name) + "' for the second time, expected another name");
    if (!roles.insert(camera.role).second)
      nodes[i].fail(
          "role", std::string("found '") + name_of(camera.role) + "' for the second time, expected one camera a role");
  }
  const RigCamera* mono = rig.find_camera(CameraRole::kMono);
  if (!mono || mono->record == RecordWhen::kDark)
    root.fail("cameras", "found no mono camera that records the sweep, expected one");
  if (roles.contains(CameraRole::kLeft) != roles.contains(CameraRole::kRight))
    root.fail("cameras", "found one eye of a stereo pair, expected left and right, or neither");
}

void settle_camera_timing(RigConfig& rig) {
  for (const RigCamera& camera : rig.cameras) {
    if (camera.record == RecordWhen::kDark || camera.trigger.mode != TriggerMode::kPosition) continue;
    if (rig.scan.capture.laser_pairs)
      throw InputError(rig.file, "camera " + camera.name +
                                     ": trigger: found position with scan: laser_pairs, expected one of the two: the "
                                     "laser is switched at equal times");
    const double period = camera.trigger.spacing / rig.scan.sweep.velocity;
    if (period < 1 / camera.rate_hz * (1 - 1e-9))
      throw InputError(rig.file, "camera " + camera.name + ": spacing_rad: found " +
                                     exact_text(camera.trigger.spacing) + ", " + exact_text(period) +
                                     " s at the sweep's velocity, expected at least a frame's time of " +
                                     exact_text(1 / camera.rate_hz) + " s");
    if (camera.role == CameraRole::kMono) rig.scan.capture.frame_period = period;
  }
  rig.scan.target = SyncTarget{rig.arm, rig.laser.ePl, rig.object.bMo.translation()};
}

}  // namespace tankrig
