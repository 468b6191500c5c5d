#include "rig/config/camera_timing.hpp"

#include <cmath>

#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig {

void read_camera_timing(const ConfigNode& node, RigCamera& camera) {
  TriggerSettings& trigger = camera.trigger;
  const std::string mode = node.has("trigger") ? node.choice("trigger", {"free", "software", "position"}) : "free";
  trigger.mode = mode == "free"       ? TriggerMode::kFree
                 : mode == "software" ? TriggerMode::kSoftware
                                      : TriggerMode::kPosition;
  if (trigger.mode == TriggerMode::kPosition)
    trigger.spacing = node.number("spacing_rad", {1e-5, 1});
  else if (node.has("spacing_rad"))
    node.fail("spacing_rad", "found with trigger: " + mode + ", expected it with trigger: position only");
  if (node.has("trigger_delay_ms")) {
    if (trigger.mode == TriggerMode::kFree)
      node.fail("trigger_delay_ms", "found with trigger: free, expected it with a trigger only");
    trigger.delay = node.milliseconds_or("trigger_delay_ms", Duration{}, {0, 1000});
  }
  camera.time_offset = from_seconds(node.number_or("time_offset_s", 0, {-1, 1}));
}

std::string camera_timing_yaml(const RigCamera& camera) {
  const TriggerSettings& t = camera.trigger;
  std::string out;
  if (t.mode != TriggerMode::kFree)
    out += std::string("    trigger: ") + (t.mode == TriggerMode::kSoftware ? "software" : "position") + "\n";
  if (t.mode == TriggerMode::kPosition) out += "    spacing_rad: " + exact_text(t.spacing) + "\n";
  if (t.delay) out += "    trigger_delay_ms: " + exact_text(1e3 * seconds(*t.delay)) + "\n";
  if (camera.time_offset.count() != 0) out += "    time_offset_s: " + exact_text(seconds(camera.time_offset)) + "\n";
  return out;
}

void settle_camera_timing(RigConfig& rig) {
  const RigCamera* mono = rig.find_camera(CameraRole::kMono);
  if (mono && mono->trigger.mode == TriggerMode::kPosition) {
    if (rig.scan.capture.laser_pairs)
      throw InputError(rig.file, "camera " + mono->name +
                                     ": trigger: found position with scan: laser_pairs, expected one of the two: the "
                                     "laser is switched at equal times");
    rig.scan.capture.frame_period = mono->trigger.spacing / rig.scan.sweep.velocity;
    if (rig.scan.capture.frame_period < 1 / mono->rate_hz * (1 - 1e-9))
      throw InputError(rig.file, "camera " + mono->name + ": spacing_rad: found " + exact_text(mono->trigger.spacing) +
                                     ", " + exact_text(rig.scan.capture.frame_period) +
                                     " s at the sweep's velocity, expected at least a frame's time of " +
                                     exact_text(1 / mono->rate_hz) + " s");
  }
  rig.scan.target = SyncTarget{rig.arm, rig.laser.ePl, rig.object.bMo.translation()};
}

}  // namespace tankrig
