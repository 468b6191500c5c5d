#include "rig/config/rig_config.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "core/shown_text.hpp"
#include "rig/config/camera_section.hpp"
#include "rig/config/obstacles_section.hpp"
#include "rig/config/scan_section.hpp"

namespace tankrig {
namespace {

const Setting<MotionLimits> kMotionLimitRows[] = {
    {"angle_margin_rad", &MotionLimits::angle_margin, ConfigRange(0, 1), "kept by whole plans from every joint limit"},
    {"max_velocity_rad_s", &MotionLimits::max_velocity, ConfigRange(0.01, 10), "of any joint of a plan"},
    {"max_ticks_per_s", &MotionLimits::max_ticks_per_s, ConfigRange(1, 1e6),
     "of any actuator of a plan; the laboratory's limit"},
};
constexpr SettingsTable<MotionLimits> kMotionLimits{kMotionLimitRows};

const Setting<RigConfig> kArmRows[] = {
    {"", &RigConfig::arm, kArmModelKeys},
    {"motion_limits", &RigConfig::motion_limits, kMotionLimits},
    {"backlash_ticks", &RigConfig::backlash_ticks, ConfigRange(0, 1e6),
     "between every encoder and its link, from end to end; 0: not known ([motion.md](motion.md))"},
};
constexpr SettingsTable<RigConfig> kArm{kArmRows};

void read_cameras(const ConfigNode& root, const char* key, RigConfig& rig) {
  for (const ConfigNode& node : root.items(key)) rig.cameras.push_back(settings_from(node, kRigCameraKeys));
  check_cameras(root, rig);
}
void write_cameras(YAML::Emitter& out, const RigConfig& rig) {
  out << YAML::BeginSeq;
  for (const RigCamera& camera : rig.cameras) write_mapping(out, kRigCameraKeys, camera);
  out << YAML::EndSeq;
}

const Setting<RigLaser> kSheetRows[] = {
    {"ePl", &RigLaser::ePl, "the sheet, rigid with the end effector; triangulation uses nothing else", Need::kRequired},
    {"origin_e_m", &RigLaser::origin_e, "the projector's exit, on the sheet", Need::kRequired},
    {"direction_e", &RigLaser::direction_e, "middle of the fan, in the sheet", Need::kRequired},
    {"fan_rad", &RigLaser::fan, ConfigRange(0.001, 3.2), "full opening angle", Need::kRequired},
};
void check_sheet(const ConfigNode& node, const RigLaser& laser) {
  constexpr double kOnTheSheet = 1e-3;
  const double length = laser.direction_e.norm(), off = laser.ePl.distance(laser.origin_e);
  if (!(length > 1e-6)) node.fail("direction_e", "found length 0, expected a direction");
  check_laser_reach(node, "origin_e_m", laser.ePl, laser.origin_e);
  if (std::abs(off) > kOnTheSheet)
    node.fail("origin_e_m", "found a point " + std::to_string(off) + " m off the sheet ePl, expected one on it");
  if (std::abs(laser.ePl.normal.dot(laser.direction_e)) > kOnTheSheet * length)
    node.fail("direction_e", "found a direction out of the sheet ePl, expected one in it");
}
constexpr SettingsTable<RigLaser> kSheet{kSheetRows, check_sheet};

const Setting<CaptureSettings> kLampRows[] = {
    {"warm_up_s", &CaptureSettings::laser_warm_up, ConfigRange(0, 600), "from supply to light", Need::kRequired},
    {"switches_per_frame", &CaptureSettings::laser_switches_per_frame,
     "it can be switched between two frames; false for a relay"},
};
constexpr SettingsTable<CaptureSettings> kLamp{kLampRows};
const Setting<ScanSettings> kLampOfScan[] = {{"", &ScanSettings::capture, kLamp}};
constexpr SettingsTable<ScanSettings> kLampInScan{kLampOfScan};

const Setting<RigConfig> kLaserRows[] = {
    {"", &RigConfig::laser, kSheet},
    {"", &RigConfig::scan, kLampInScan},
};
constexpr SettingsTable<RigConfig> kLaser{kLaserRows};

const Setting<RigObject> kObjectRows[] = {
    {"mesh", &RigObject::mesh, "any triangle mesh, in metres", Need::kRequired},
    {"bMo", &RigObject::bMo, "the mesh's frame in the arm's base", Need::kRequired},
};
constexpr SettingsTable<RigObject> kObject{kObjectRows};

void read_backend(const ConfigNode& root, const char* key, RigConfig& rig) {
  rig.backend = root.choice(key, {"mock", "devices"});
}
void check_scene(const ConfigNode& root, const RigConfig& rig) {
  if (rig.backend == "mock") static_cast<void>(root.text("scene"));  // must be there
}

/// But for `base` and `presets`, which are gone from a rig that was read.
const Setting<RigConfig> kRigRows[] = {
    {"name", &RigConfig::name, "for reports and sessions", Need::kRequired},
    {"description", &RigConfig::description, "for people"},
    {"backend",
     {read_backend, [](YAML::Emitter& out, const RigConfig& rig) { out << rig.backend; }, "mock, devices"},
     "mock: simulated, in virtual time; devices: drivers, in real time",
     Need::kRequired},
    {"scene", &RigConfig::scene, "what is simulated or emulated ([scene.md](scene.md)); required by backend mock",
     Need::kSparse},
    {"applied_preset", &RigConfig::preset, "in sessions only", Need::kSparse},
    {"calibration", &RigConfig::calibration_file,
     "measured values instead of those below ([calibration.md](calibration.md))", Need::kSparse},
    {"applied_calibration_sha256", &RigConfig::calibration_sha256, "in sessions only", Need::kSparse},
    {"arm", kArm, Need::kRequired},
    {"cameras",
     {read_cameras, write_cameras, "",
      [](const std::string& place) { return settings_rows(place + "[]", kRigCameraKeys); }},
     "",
     Need::kRequired},
    {"laser", kLaser, Need::kRequired},
    {"object", &RigConfig::object, kObject, Need::kRequired},
    {"obstacles", &RigConfig::obstacles, kObstacleKeys, Need::kRequired},
    {"scan", &RigConfig::scan, kScanKeys, Need::kRequired},
};
constexpr SettingsTable<RigConfig> kRig{kRigRows, check_scene};

void refuse_unknown_keys(const ConfigNode& root) {
  std::vector<std::string> known{"base"};
  for (const Setting<RigConfig>& setting : kRig.rows) known.emplace_back(setting.name);
  known.emplace_back("presets");
  known.insert(known.end(), kForeignSections.begin(), kForeignSections.end());
  for (const std::string& key : root.keys())
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      std::string list;
      for (const std::string& k : known) list += (list.empty() ? "" : ", ") + k;
      root.fail(key, "unknown key, expected one of: " + list);
    }
}

/// All presets are read, so that a bad one is found whichever is asked for.
void read_presets(const ConfigNode& root, const std::string& wanted, RigConfig& rig) {
  const auto presets = root.optional_child("presets");
  std::string known;
  ScanSettings chosen = rig.scan;
  bool found = wanted.empty();
  for (const std::string& name : presets ? presets->keys() : std::vector<std::string>{}) {
    ScanSettings scan = rig.scan;
    const ConfigNode node = presets->child(name);
    read_settings(node, kScanKeys, scan, false);
    check_scan_section(node, scan, rig.arm);
    known += (known.empty() ? "" : ", ") + shown_text(name);
    if (name == wanted) chosen = scan, found = true;
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
  constexpr int kMostBases = 3;
  ConfigNode rig = ConfigNode::load(file);
  std::optional<ConfigNode> lowest = rig;
  for (int bases = 0; lowest->has("base"); ++bases) {
    if (bases == kMostBases) lowest->fail("base", "found a fourth base below the rig file, expected three at most");
    lowest = ConfigNode::load(lowest->path("base"));
    rig = rig.over(*lowest);
  }
  return rig;
}

namespace {

RigConfig read_rig(const ConfigNode& file, const std::string& preset, const std::filesystem::path& calibration,
                   bool calibrated) {
  RigConfig rig(file);
  const ConfigNode& root = rig.root;
  refuse_unknown_keys(root);
  read_settings(root, kRig, rig);
  for (const char* section : {"arm", "laser", "object", "obstacles", "scan"}) root.child(section).finish();

  if (!calibration.empty()) rig.calibration_file = std::filesystem::absolute(calibration);
  if (!calibrated) rig.calibration_file.clear();
  if (!rig.calibration_file.empty()) rig.calibration = apply_calibration(rig.calibration_file, rig);
  rig.scan.limits.angles = rig.arm.limits;
  rig.scan.capture.frame_period = 1 / rig.find_camera(CameraRole::kMono)->rate_hz;
  if (std::abs(rig.laser.direction_e.norm() - 1) > 1e-14) rig.laser.direction_e.normalize();
  check_scan_section(root.child("scan"), rig.scan, rig.arm);
  read_presets(root, preset, rig);
  check_waived(root, rig);
  settle_camera_timing(rig);
  if (!preset.empty()) rig.preset = preset;
  return rig;
}

}  // namespace

RigConfig load_rig(const std::filesystem::path& file, const std::string& preset,
                   const std::filesystem::path& calibration) {
  return read_rig(rig_file(file), preset, calibration);
}

RigConfig read_rig(const ConfigNode& file, const std::string& preset, const std::filesystem::path& calibration) {
  return read_rig(file, preset, calibration, true);
}

RigConfig load_drawn_rig(const std::filesystem::path& file) { return read_rig(rig_file(file), "", "", false); }

std::string rig_key_rows() {
  return "| `base` | none | a file | a rig file whose keys hold where this one has none, mapping by mapping; lists are "
         "not merged |\n" +
         settings_rows("", kRig, RigConfig(ConfigNode::parse("{}", ""))) +
         "| `presets.NAME` | none | any part of `scan` | what `--preset NAME` changes |\n";
}

std::string resolved_rig_yaml(const RigConfig& rig, const std::string& mesh) {
  RigConfig stored = rig;
  stored.object.mesh = mesh;
  stored.calibration_file.clear();  // its values stand where the nominal ones did
  YAML::Emitter out;
  out << YAML::Comment("The rig as it was used by this scan.") << YAML::BeginMap;
  write_settings(out, kRig, stored);
  for (const char* name : kForeignSections)
    if (const auto section = rig.section(name)) {
      out << YAML::Key << name << YAML::Value;
      section->write(out);
    }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace tankrig
