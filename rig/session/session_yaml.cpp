#include "rig/session/session_yaml.hpp"

#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "rig/session/model_yaml.hpp"
#include "rig/session/sha256.hpp"
#include "rig/session/text_files.hpp"

namespace tankrig {
namespace {

constexpr const char* kFormat = "tankrig-session 1";

std::uint64_t read_count(const ConfigNode& node, const std::string& key) {
  const std::string text = node.text(key);
  std::uint64_t value = 0;
  if (!parse_number(text, value)) node.fail(key, "found '" + text + "', expected a whole number of at least 0");
  return value;
}

TableSpan read_span(const ConfigNode& node) {
  const auto stamp = [&](const char* key) {
    const std::string text = node.text(key);
    Stamp value{};
    if (!parse_number(text, value.ns)) node.fail(key, "found '" + text + "', expected a whole number");
    return value;
  };
  return {read_count(node, "lines"), stamp("first_ns"), stamp("last_ns")};
}

std::optional<double> read_optional(const ConfigNode& node, const char* key, ConfigNode::Range range) {
  if (!node.has(key)) return std::nullopt;
  return node.number(key, range);
}

std::string yaml_of(const ClockPair& pair) {
  return "{stamp_ns: " + std::to_string(pair.stamp.ns) + ", wall_ns: " + std::to_string(pair.wall_ns) + "}";
}

std::optional<ClockPair> read_clock_pair(const ConfigNode& clock, const char* key) {
  const auto node = clock.optional_child(key);
  if (!node) return std::nullopt;
  const auto whole = [&](const char* name) {
    const std::string text = node->text(name);
    std::int64_t value = 0;
    if (!parse_number(text, value)) node->fail(name, "found '" + shown_text(text) + "', expected a whole number");
    return value;
  };
  return ClockPair{{whole("stamp_ns")}, whole("wall_ns")};
}

SessionCamera read_camera(const ConfigNode& node) {
  SessionCamera camera;
  camera.name = node.text("name");
  const std::string role = node.choice("role", {"mono", "left", "right"});
  camera.role = role == "mono" ? CameraRole::kMono : role == "left" ? CameraRole::kLeft : CameraRole::kRight;
  camera.model = read_camera_model(node.child("model"));
  camera.bMc = node.transform("bMc");
  camera.time_offset = from_seconds(node.number_or("time_offset_s", 0, {-10, 10}));
  return camera;
}

void read_calibration(const ConfigNode& root, SessionInfo& info) {
  for (const ConfigNode& camera : root.items("cameras")) info.cameras.push_back(read_camera(camera));
  if (const auto calibration = root.optional_child("calibration")) {
    if (const auto arm = calibration->optional_child("arm")) info.calibration.arm = read_arm_model(*arm);
    if (const auto plane = calibration->optional_child("ePl")) info.calibration.ePl = read_plane(*plane);
    info.calibration.laser_origin_e = read_vector(*calibration, "laser_origin_e_m");
    info.calibration.laser_direction_e = read_vector(*calibration, "laser_direction_e");
    info.calibration.laser_fan = calibration->number("laser_fan_rad", {0, 3.2});
  }
  if (const auto object = root.optional_child("object"))
    info.object = SessionObject{object->text("mesh"), object->transform("bMo")};
}

}  // namespace

std::string calibration_yaml(const SessionInfo& info) {
  std::string out = info.cameras.empty() ? "cameras: []\n" : "cameras:\n";
  for (const SessionCamera& camera : info.cameras)
    out +=
        "  - name: " + yaml_quoted(camera.name) + "\n    role: " + to_string(camera.role) +
        "\n    model: " + yaml_of(camera.model) + "\n    bMc: " + yaml_of(camera.bMc) + "\n" +
        (camera.time_offset.count() == 0 ? "" : "    time_offset_s: " + exact_text(seconds(camera.time_offset)) + "\n");
  out += "calibration:\n";
  if (info.calibration.arm) out += "  arm:\n" + yaml_of(*info.calibration.arm, 4);
  if (info.calibration.ePl) out += "  ePl: " + yaml_of(*info.calibration.ePl) + "\n";
  out += "  laser_origin_e_m: " + yaml_of(info.calibration.laser_origin_e) + "\n";
  out += "  laser_direction_e: " + yaml_of(info.calibration.laser_direction_e) + "\n";
  out += "  laser_fan_rad: " + exact_text(info.calibration.laser_fan) + "\n";
  if (info.object)
    out += "object:\n  mesh: " + yaml_quoted(info.object->mesh) + "\n  bMo: " + yaml_of(info.object->bMo) + "\n";
  return out;
}

std::string session_yaml(const SessionInfo& info) {
  std::string out = std::string("format: ") + kFormat + "\n";
  const auto text = [&](const char* key, const std::string& value) {
    out += std::string(key) + ": " + yaml_quoted(value) + "\n";
  };
  const auto optional = [&](const char* key, const std::optional<double>& value) {
    if (value) out += std::string(key) + ": " + exact_text(*value) + "\n";
  };
  text("name", info.name);
  text("status", info.status);
  text("kind", info.kind);
  text("created_utc", info.created_utc);
  if (info.clock_begin) out += "clock:\n  begin: " + yaml_of(*info.clock_begin) + "\n";
  if (info.clock_begin && info.clock_end) out += "  end: " + yaml_of(*info.clock_end) + "\n";
  text("operator", info.operator_name);
  text("notes", info.notes);
  text("rig", info.rig);
  text("rig_sha256", info.rig_hash);
  text("software", info.software);
  text("noise", info.noise);
  out += "seed: " + std::to_string(info.seed) + "\n";
  optional("light", info.light);
  if (!info.lux_source.empty()) out += "lux_source: " + info.lux_source + "\n";
  optional("lux_before", info.lux_before);
  optional("lux_after", info.lux_after);
  optional("simulated_s", info.simulated_s);
  out += info.counts.empty() ? "counts: {}\n" : "counts:\n";
  for (const auto& [reason, count] : info.counts)
    out += "  " + yaml_quoted(reason) + ": " + std::to_string(count) + "\n";
  if (!info.devices.empty()) out += "devices:\n";
  for (const auto& [name, value] : info.devices) out += "  " + yaml_quoted(name) + ": " + exact_text(value) + "\n";
  if (info.timing) out += timing_yaml(*info.timing);
  if (!info.platform.empty()) out += "platform:\n";
  for (const auto& [what, found] : info.platform) out += "  " + yaml_quoted(what) + ": " + yaml_quoted(found) + "\n";
  if (!info.tables.empty()) out += "tables:\n";
  for (const auto& [name, span] : info.tables)
    out += "  " + name + ": {lines: " + std::to_string(span.lines) + ", first_ns: " + std::to_string(span.first.ns) +
           ", last_ns: " + std::to_string(span.last.ns) + "}\n";
  if (!info.recovered.empty()) out += "recovered:\n";
  for (const std::string& loss : info.recovered) out += "  - " + yaml_quoted(loss) + "\n";
  const std::string calibration = calibration_yaml(info);
  text("calibration_sha256", sha256_of_text(calibration));
  return out + calibration;
}

SessionInfo read_session_yaml(const std::filesystem::path& file) {
  const ConfigNode root = ConfigNode::load(file);
  root.choice("format", {kFormat});
  SessionInfo info;
  info.name = root.text("name");
  info.status = root.text("status");
  info.kind = root.choice("kind", {"scan", "import"});
  info.created_utc = root.text("created_utc");
  if (const auto clock = root.optional_child("clock")) {
    info.clock_begin = read_clock_pair(*clock, "begin");
    info.clock_end = read_clock_pair(*clock, "end");
  }
  info.operator_name = root.text("operator");
  info.notes = root.text("notes");
  info.rig = root.text("rig");
  info.rig_hash = root.text("rig_sha256");
  info.software = root.text("software");
  info.noise = root.text("noise");
  info.seed = read_count(root, "seed");
  info.light = read_optional(root, "light", {0, 1});
  if (root.has("lux_source")) info.lux_source = root.choice("lux_source", {"meter", "hand"});
  info.lux_before = read_optional(root, "lux_before", {0, 1e7});
  info.lux_after = read_optional(root, "lux_after", {0, 1e7});
  info.simulated_s = root.number_or("simulated_s", 0, {0, 1e9});
  const ConfigNode counts = root.child("counts");
  for (const std::string& reason : counts.keys()) info.counts[reason] = read_count(counts, reason);
  if (const auto devices = root.optional_child("devices"))
    for (const std::string& name : devices->keys()) info.devices[name] = devices->number(name);
  if (const auto timing = root.optional_child("timing")) info.timing = read_timing(*timing);
  if (const auto platform = root.optional_child("platform"))
    for (const std::string& what : platform->keys()) info.platform[what] = platform->text(what);
  if (const auto tables = root.optional_child("tables"))
    for (const std::string& name : tables->keys()) info.tables[name] = read_span(tables->child(name));
  if (root.has("recovered")) info.recovered = root.texts("recovered");
  info.calibration_hash = root.text("calibration_sha256");
  read_calibration(root, info);
  root.finish();
  return info;
}

bool calibration_is_as_recorded(const std::filesystem::path& file, const SessionInfo& info) {
  const std::string text = read_whole_file(file);
  const std::size_t begin = text.find("\ncameras:");
  return begin != std::string::npos &&
         sha256_of_text(std::string_view(text).substr(begin + 1)) == info.calibration_hash;
}

}  // namespace tankrig
