// The rig file a session keeps: what was really used, and loadable again.
#include <sstream>

#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/text_files.hpp"
#include "rig/config/camera_timing.hpp"
#include "rig/config/obstacles_section.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/config/scan_section.hpp"

namespace tankrig {
namespace {

std::string cameras_yaml(const std::vector<RigCamera>& cameras) {
  constexpr const char* kRecord[] = {"all", "dark", "sweep"};
  std::string out = "cameras:\n";
  for (const RigCamera& c : cameras)
    out += "  - name: " + yaml_quoted(c.name) + "\n    role: " + to_string(c.role) +
           "\n    model: " + yaml_of(c.model) + "\n    bMc: " + yaml_of(c.bMc) +
           "\n    body: " + camera_body_yaml(c.body) + "\n    record: " + kRecord[static_cast<int>(c.record)] +
           "\n    rate_hz: " + exact_text(c.rate_hz) + "\n" + camera_timing_yaml(c);
  return out;
}

std::string laser_yaml(const RigConfig& rig) {
  const RigLaser& l = rig.laser;
  return "laser:\n  ePl: " + yaml_of(l.ePl) + "\n  origin_e_m: " + yaml_of(l.origin_e) +
         "\n  direction_e: " + yaml_of(l.direction_e) + "\n  fan_rad: " + exact_text(l.fan) +
         "\n  warm_up_s: " + exact_text(rig.scan.capture.laser_warm_up) +
         "\n  switches_per_frame: " + (rig.scan.capture.laser_switches_per_frame ? "true" : "false") + "\n";
}

std::string backlash_yaml(const std::array<double, kJoints>& ticks) {
  std::string list;
  for (const double n : ticks) list += (list.empty() ? "" : ", ") + exact_text(n);
  return "  backlash_ticks: [" + list + "]\n";
}

std::string motion_limits_yaml(const MotionLimits& m) {
  return "  motion_limits:\n    angle_margin_rad: " + exact_text(m.angle_margin) +
         "\n    max_velocity_rad_s: " + exact_text(m.max_velocity) +
         "\n    max_ticks_per_s: " + exact_text(m.max_ticks_per_s) + "\n";
}

std::string indented(const std::string& text) {
  std::string out, line;
  for (std::istringstream lines(text); std::getline(lines, line);) out += "  " + line + "\n";
  return out;
}

/// Replaces the value of the first line "  key: value" by an absolute path.
void make_absolute(std::string& text, const std::string& key, const std::string& value,
                   const std::filesystem::path& absolute) {
  std::size_t at = 0;
  while ((at = text.find(key + ":", at)) != std::string::npos) {
    const std::size_t line = text.rfind('\n', at) + 1, end = std::min(text.find('\n', at), text.size());
    const std::size_t found = text.find(value, at + key.size() + 1);
    if (text.find_first_not_of(' ', line) == at && found < end) {
      text.replace(found, value.size(), absolute.string());
      return;
    }
    at = end;
  }
}

}  // namespace

std::string resolved_rig_yaml(const RigConfig& rig, const std::string& mesh) {
  std::string out = "# The rig as it was used by this scan.\n";
  out += "name: " + yaml_quoted(rig.name) + "\ndescription: " + yaml_quoted(rig.description) +
         "\nbackend: " + rig.backend + "\n";
  if (!rig.scene.empty()) out += "scene: " + yaml_quoted(rig.scene.string()) + "\n";
  if (!rig.preset.empty()) out += "applied_preset: " + yaml_quoted(rig.preset) + "\n";
  out += "arm:\n" + yaml_of(rig.arm, 2) + motion_limits_yaml(rig.motion_limits) + backlash_yaml(rig.backlash_ticks);
  out += cameras_yaml(rig.cameras) + laser_yaml(rig);
  out += "object:\n  mesh: " + yaml_quoted(mesh) + "\n  bMo: " + yaml_of(rig.object.bMo) + "\n";
  out += "obstacles:\n" + indented(obstacles_section_yaml(rig.obstacles)) + "scan:\n" +
         indented(scan_section_yaml(rig.scan, rig.read_lux));
  for (const char* name : kForeignSections)
    if (const auto node = rig.section(name)) out += std::string(name) + ":\n" + indented(node->yaml());
  return out;
}

std::string rig_file_for_elsewhere(const std::filesystem::path& file) {
  std::string text = read_whole_file(file);
  const ConfigNode root = ConfigNode::load(file);
  for (const char* key : {"base", "scene"})
    if (root.has(key)) make_absolute(text, key, root.text(key), root.path(key));
  if (const auto object = root.optional_child("object"))
    make_absolute(text, "mesh", object->text("mesh"), object->path("mesh"));
  return text;
}

}  // namespace tankrig
