#include "rig/config/rig_config.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/regular_file.hpp"
#include "core/session_names.hpp"
#include "core/shown_text.hpp"
#include "rig/config/camera_timing.hpp"
#include "rig/config/obstacles_section.hpp"
#include "rig/config/scan_section.hpp"

namespace tankrig {
namespace {

constexpr std::array kOwnKeys{"base", "name",    "description", "backend", "scene",  "applied_preset", "arm",
                              "scan", "presets", "cameras",     "laser",   "object", "obstacles"};

void refuse_unknown_keys(const ConfigNode& root) {
  for (const std::string& key : root.keys()) {
    const auto is_key = [&](const char* known) { return key == known; };
    if (std::any_of(kOwnKeys.begin(), kOwnKeys.end(), is_key) ||
        std::any_of(kForeignSections.begin(), kForeignSections.end(), is_key))
      continue;
    std::string known;
    for (const char* k : kOwnKeys) known += std::string(k) + ", ";
    for (const char* k : kForeignSections) known += std::string(k) + (k == kForeignSections.back() ? "" : ", ");
    root.fail(key, "unknown key, expected one of: " + known);
  }
}

void read_backlash(const ConfigNode& arm, std::array<double, kJoints>& ticks) {
  if (!arm.has("backlash_ticks")) return;
  const auto values = arm.numbers("backlash_ticks", kJoints);
  if (*std::min_element(values.begin(), values.end()) < 0)
    arm.fail("backlash_ticks", "found a negative number, expected five of 0 or more");
  std::copy(values.begin(), values.end(), ticks.begin());
}

void read_arm(const ConfigNode& node, RigConfig& rig) {
  rig.arm = read_arm_model(node);
  rig.scan.limits.angles = rig.arm.limits;
  if (const auto limits = node.optional_child("motion_limits")) {
    MotionLimits& m = rig.motion_limits;
    m.angle_margin = limits->number_or("angle_margin_rad", m.angle_margin, {0, 1});
    m.max_velocity = limits->number_or("max_velocity_rad_s", m.max_velocity, {0.01, 10});
    m.max_ticks_per_s = limits->number_or("max_ticks_per_s", m.max_ticks_per_s, {1, 1e6});
  }
  read_backlash(node, rig.backlash_ticks);
  node.finish();
}

RigCamera read_camera(const ConfigNode& node) {
  RigCamera camera;
  camera.name = node.text("name");
  if (!is_camera_name(camera.name))
    node.fail("name", "found '" + shown_text(camera.name) + "', " + kCameraNameExpected);
  const std::string role = node.choice("role", {"mono", "left", "right"});
  camera.role = role == "mono" ? CameraRole::kMono : role == "left" ? CameraRole::kLeft : CameraRole::kRight;
  camera.model = read_camera_model(node.child("model"));
  camera.bMc = node.transform("bMc");
  read_camera_body(node, camera.body);
  const std::string record = node.choice("record", {"all", "dark", "sweep"});
  camera.record = record == "all" ? RecordWhen::kAll : record == "dark" ? RecordWhen::kDark : RecordWhen::kSweep;
  camera.rate_hz = node.number("rate_hz", {0.1, 1000});
  read_camera_timing(node, camera);
  node.finish();
  return camera;
}

void read_cameras(const ConfigNode& root, RigConfig& rig) {
  std::set<std::string> names;
  std::set<CameraRole> roles;
  for (const ConfigNode& node : root.items("cameras")) {
    rig.cameras.push_back(read_camera(node));
    const RigCamera& camera = rig.cameras.back();
    if (!names.insert(camera.name).second)
      node.fail("name", "found '" + shown_text(camera.name) + "' for the second time, expected another name");
    if (!roles.insert(camera.role).second)
      node.fail("role",
                std::string("found '") + to_string(camera.role) + "' for the second time, expected one camera a role");
  }
  const RigCamera* mono = rig.find_camera(CameraRole::kMono);
  if (!mono || mono->record == RecordWhen::kDark)
    root.fail("cameras", "found no mono camera that records the sweep, expected one");
  if (roles.contains(CameraRole::kLeft) != roles.contains(CameraRole::kRight))
    root.fail("cameras", "found one eye of a stereo pair, expected left and right, or neither");
  rig.scan.capture.frame_period = 1.0 / mono->rate_hz;
}

void read_laser(const ConfigNode& node, RigConfig& rig) {
  RigLaser& laser = rig.laser;
  laser.ePl = read_plane(node.child("ePl"));
  laser.origin_e = read_vector(node, "origin_e_m");
  laser.direction_e = read_vector(node, "direction_e");
  if (!(laser.direction_e.norm() > 1e-6)) node.fail("direction_e", "found length 0, expected a direction");
  if (std::abs(laser.direction_e.norm() - 1) > 1e-14) laser.direction_e.normalize();
  laser.fan = node.number("fan_rad", {0.001, 3.2});
  rig.scan.capture.laser_warm_up = node.number("warm_up_s", {0, 600});
  rig.scan.capture.laser_switches_per_frame = node.flag_or("switches_per_frame", false);
  if (std::abs(laser.ePl.distance(laser.origin_e)) > 1e-3)
    node.fail("origin_e_m", "found a point " + std::to_string(laser.ePl.distance(laser.origin_e)) +
                                " m off the sheet ePl, expected one on it");
  if (std::abs(laser.ePl.normal.dot(laser.direction_e)) > 1e-3)
    node.fail("direction_e", "found a direction out of the sheet ePl, expected one in it");
  node.finish();
}

/// All presets are read, so that a bad one is found whichever is asked for.
void read_presets(const ConfigNode& root, const std::string& wanted, RigConfig& rig) {
  const auto presets = root.optional_child("presets");
  std::string known;
  ScanSettings chosen = rig.scan;
  bool found = wanted.empty();
  for (const std::string& name : presets ? presets->keys() : std::vector<std::string>{}) {
    ScanSettings scan = rig.scan;
    bool read_lux = rig.read_lux;
    const ConfigNode node = presets->child(name);
    read_scan_section(node, false, scan, read_lux);
    check_scan_section(node, scan, rig.arm);
    known += (known.empty() ? "" : ", ") + shown_text(name);
    if (name == wanted) chosen = scan, rig.read_lux = read_lux, found = true;
  }
  if (presets) presets->finish();
  if (!found)
    throw InputError(rig.file, "presets: found no '" + shown_text(wanted) + "', expected " +
                                   (known.empty() ? "none: the file has no presets" : "one of: " + known));
  rig.scan = chosen;
}

/// A name that is no camera's would waive nothing, unnoticed.
void check_waived(const ConfigNode& root, const RigConfig& rig) {
  for (const std::string& name : rig.scan.safety.beam.waived) {
    const auto is_named = [&](const RigCamera& camera) { return camera.name == name; };
    if (std::none_of(rig.cameras.begin(), rig.cameras.end(), is_named))
      root.fail("scan", "safety.beam.waived: found '" + shown_text(name) + "', expected the name of a camera");
  }
}

}  // namespace

std::optional<ConfigNode> RigConfig::section(std::string_view section_name) const {
  return root.optional_child(section_name);
}

const RigCamera* RigConfig::find_camera(CameraRole role) const {
  for (const RigCamera& camera : cameras)
    if (camera.role == role) return &camera;
  return nullptr;
}

ConfigNode rig_file(const std::filesystem::path& file) {
  const ConfigNode root = ConfigNode::load(file);
  if (!root.has("base")) return root;
  const ConfigNode base = ConfigNode::load(root.path("base"));
  if (base.has("base")) base.fail("base", "found a base of a base, expected a rig file that stands alone");
  return root.over(base);
}

RigConfig load_rig(const std::filesystem::path& file, const std::string& preset) {
  return read_rig(rig_file(file), preset);
}

RigConfig read_rig(const ConfigNode& file, const std::string& preset) {
  RigConfig rig(file);
  const ConfigNode& root = rig.root;
  refuse_unknown_keys(root);
  rig.name = root.text("name");
  rig.description = root.text_or("description", "");
  rig.backend = root.choice("backend", {"mock", "devices"});
  if (rig.backend == "mock" || root.has("scene")) rig.scene = root.path("scene");
  read_arm(root.child("arm"), rig);
  read_cameras(root, rig);
  read_laser(root.child("laser"), rig);
  const ConfigNode object = root.child("object");
  rig.object = {object.path("mesh"), object.transform("bMo")};
  object.finish();
  read_obstacles_section(root.child("obstacles"), rig.obstacles);

  const ConfigNode scan = root.child("scan");
  read_scan_section(scan, true, rig.scan, rig.read_lux);
  scan.finish();
  check_scan_section(scan, rig.scan, rig.arm);
  read_presets(root, preset, rig);
  check_waived(root, rig);
  settle_camera_timing(rig);
  rig.preset = preset.empty() ? root.text_or("applied_preset", "") : preset;
  return rig;
}

}  // namespace tankrig
