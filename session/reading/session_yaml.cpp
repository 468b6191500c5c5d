#include "session/reading/session_yaml.hpp"

#include <fmt/core.h>

#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/session_names.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace tankrig {
namespace {

constexpr const char* kFormat = "tankrig-session 1";

TableSpan read_span(const ConfigNode& node) {
  return {read_whole<std::uint64_t>(node, "lines"),
          {read_whole<std::int64_t>(node, "first_ns")},
          {read_whole<std::int64_t>(node, "last_ns")}};
}

/// What is unaccounted for follows from the counts, where they are there.
CameraAccount read_account(const ConfigNode& node, const std::string& camera, const FrameCounts& counts) {
  CameraAccount account{read_whole<std::uint64_t>(node, "expected"), read_whole<std::int64_t>(node, "unaccounted")};
  if (counts.contains(camera + ".recorded")) account.unaccounted = unaccounted(counts, camera, account.expected);
  return account;
}

std::string yaml_of(const ClockPair& pair) {
  return fmt::format("{{stamp_ns: {}, wall_ns: {}}}", pair.stamp.ns, pair.wall_ns);
}

std::optional<ClockPair> clock_pair_from(const ConfigNode& clock, const char* key) {
  const auto node = clock.optional_child(key);
  if (!node) return std::nullopt;
  return ClockPair{{read_whole<std::int64_t>(*node, "stamp_ns")}, read_whole<std::int64_t>(*node, "wall_ns")};
}

SessionCamera read_camera(const ConfigNode& node) {
  SessionCamera camera;
  camera.name = node.text("name");
  if (!is_camera_name(camera.name))
    node.fail("name", "found '" + shown_text(camera.name) + "', " + kCameraNameExpected);
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
  if (const auto object = root.optional_child("object")) {
    info.object = SessionObject{object->text("mesh"), object->transform("bMo")};
    if (!is_file_name(info.object->mesh))
      object->fail("mesh", "found '" + shown_text(info.object->mesh) + "', expected the name of a file in the session");
  }
}

}  // namespace

std::string calibration_yaml(const SessionInfo& info) {
  std::string out = info.cameras.empty() ? "cameras: []\n" : "cameras:\n";
  for (const SessionCamera& camera : info.cameras)
    out +=
        fmt::format("  - name: {}\n    role: {}\n    model: {}\n    bMc: {}\n", yaml_quoted(camera.name),
                    to_string(camera.role), yaml_of(camera.model), yaml_of(camera.bMc)) +
        (camera.time_offset.count() == 0 ? "" : "    time_offset_s: " + exact_text(seconds(camera.time_offset)) + "\n");
  out += "calibration:\n";
  if (info.calibration.arm) out += "  arm:\n" + yaml_of(*info.calibration.arm, 4);
  if (info.calibration.ePl) out += "  ePl: " + yaml_of(*info.calibration.ePl) + "\n";
  out += "  laser_origin_e_m: " + yaml_of(info.calibration.laser_origin_e) + "\n";
  out += "  laser_direction_e: " + yaml_of(info.calibration.laser_direction_e) + "\n";
  out += "  laser_fan_rad: " + exact_text(info.calibration.laser_fan) + "\n";
  if (info.object)
    out += fmt::format("object:\n  mesh: {}\n  bMo: {}\n", yaml_quoted(info.object->mesh), yaml_of(info.object->bMo));
  return out;
}

std::string session_yaml(const SessionInfo& info, const std::string& calibration) {
  std::string out = fmt::format("format: {}\n", kFormat);
  const auto text = [&](const char* key, const std::string& value) {
    out += fmt::format("{}: {}\n", key, yaml_quoted(value));
  };
  const auto optional = [&](const char* key, const std::optional<double>& value) {
    if (value) out += fmt::format("{}: {}\n", key, exact_text(*value));
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
  out += fmt::format("seed: {}\n", info.seed);
  optional("light", info.light);
  if (!info.lux_source.empty()) out += "lux_source: " + info.lux_source + "\n";
  optional("lux_before", info.lux_before);
  optional("lux_after", info.lux_after);
  optional("simulated_s", info.simulated_s);
  out += info.counts.empty() ? "counts: {}\n" : "counts:\n";
  for (const auto& [reason, count] : info.counts) out += fmt::format("  {}: {}\n", yaml_quoted(reason), count);
  if (!info.account.empty()) out += "account:\n";
  for (const auto& [camera, account] : info.account)
    out += fmt::format("  {}: {{expected: {}, unaccounted: {}}}\n", yaml_quoted(camera), account.expected,
                       account.unaccounted);
  if (!info.devices.empty()) out += "devices:\n";
  for (const auto& [name, value] : info.devices) out += fmt::format("  {}: {}\n", yaml_quoted(name), exact_text(value));
  if (info.timing) out += timing_yaml(*info.timing);
  if (!info.platform.empty()) out += "platform:\n";
  for (const auto& [what, found] : info.platform)
    out += fmt::format("  {}: {}\n", yaml_quoted(what), yaml_quoted(found));
  if (!info.tables.empty()) out += "tables:\n";
  for (const auto& [name, span] : info.tables)
    out +=
        fmt::format("  {}: {{lines: {}, first_ns: {}, last_ns: {}}}\n", name, span.lines, span.first.ns, span.last.ns);
  if (!info.recovered.empty()) out += "recovered:\n";
  for (const std::string& loss : info.recovered) out += "  - " + yaml_quoted(loss) + "\n";
  text("calibration_sha256", info.calibration_hash);
  return out + calibration;
}

std::string session_yaml(const SessionInfo& info) {
  const std::string calibration = calibration_yaml(info);
  SessionInfo hashed = info;
  hashed.calibration_hash = sha256_of_text(calibration);
  return session_yaml(hashed, calibration);
}

const std::vector<SessionSection>& session_sections() {
  using Node = const ConfigNode&;
  using Info = SessionInfo&;
  static const std::vector<SessionSection> kSections{
      {"format", true, [](Node n, Info) { n.choice("format", {kFormat}); }},
      {"name", true, [](Node n, Info i) { i.name = n.text("name"); }},
      {"status", true, [](Node n, Info i) { i.status = n.text("status"); }},
      {"kind", true,
       [](Node n, Info i) {
         i.kind = n.choice("kind", {"scan", "import"});
       }},
      {"created_utc", true, [](Node n, Info i) { i.created_utc = n.text("created_utc"); }},
      {"clock", false,
       [](Node n, Info i) {
         const ConfigNode clock = n.child("clock");
         i.clock_begin = clock_pair_from(clock, "begin");
         i.clock_end = clock_pair_from(clock, "end");
       }},
      {"operator", true, [](Node n, Info i) { i.operator_name = n.text("operator"); }},
      {"notes", true, [](Node n, Info i) { i.notes = n.text("notes"); }},
      {"rig", true, [](Node n, Info i) { i.rig = n.text("rig"); }},
      {"rig_sha256", true, [](Node n, Info i) { i.rig_hash = n.text("rig_sha256"); }},
      {"software", true, [](Node n, Info i) { i.software = n.text("software"); }},
      {"noise", true, [](Node n, Info i) { i.noise = n.text("noise"); }},
      {"seed", true, [](Node n, Info i) { i.seed = read_whole<std::uint64_t>(n, "seed"); }},
      {"light", false,
       [](Node n, Info i) {
         i.light = n.number("light", {0, 1});
       }},
      {"lux_source", false,
       [](Node n, Info i) {
         i.lux_source = n.choice("lux_source", {"meter", "hand"});
       }},
      {"lux_before", false,
       [](Node n, Info i) {
         i.lux_before = n.number("lux_before", {0, kMaxLux});
       }},
      {"lux_after", false,
       [](Node n, Info i) {
         i.lux_after = n.number("lux_after", {0, kMaxLux});
       }},
      {"simulated_s", false,
       [](Node n, Info i) {
         i.simulated_s = n.number("simulated_s", {0, 1e9});
       }},
      {"counts", true,
       [](Node n, Info i) {
         const ConfigNode counts = n.child("counts");
         for (const std::string& reason : counts.keys()) i.counts[reason] = read_whole<std::uint64_t>(counts, reason);
       }},
      {"account", false,
       [](Node n, Info i) {
         const ConfigNode account = n.child("account");
         for (const std::string& camera : account.keys())
           i.account[camera] = read_account(account.child(camera), camera, i.counts);
       }},
      {"devices", false,
       [](Node n, Info i) {
         const ConfigNode devices = n.child("devices");
         for (const std::string& name : devices.keys()) i.devices[name] = devices.number(name);
       }},
      {"timing", false, [](Node n, Info i) { i.timing = read_timing(n.child("timing")); }},
      {"platform", false,
       [](Node n, Info i) {
         const ConfigNode platform = n.child("platform");
         for (const std::string& what : platform.keys()) i.platform[what] = platform.text(what);
       }},
      {"tables", false,
       [](Node n, Info i) {
         const ConfigNode tables = n.child("tables");
         for (const std::string& name : tables.keys()) i.tables[name] = read_span(tables.child(name));
       }},
      {"recovered", false, [](Node n, Info i) { i.recovered = n.texts("recovered"); }},
      {"calibration_sha256", true, [](Node n, Info i) { i.calibration_hash = n.text("calibration_sha256"); }}};
  return kSections;
}

SessionInfo read_session_yaml(const std::filesystem::path& file) {
  const ConfigNode root = ConfigNode::load(file);
  SessionInfo info;
  for (const SessionSection& section : session_sections())
    if (section.required || root.has(section.key)) section.read(root, info);
  read_calibration(root, info);
  root.finish();
  return info;
}

void read_calibration_yaml(const std::string& text, const std::filesystem::path& file, SessionInfo& info) {
  const ConfigNode root = ConfigNode::parse(text, file);
  SessionInfo read;
  read_calibration(root, read);
  root.finish();
  take_calibration(read, info);
}

void take_calibration(const SessionInfo& from, SessionInfo& to) {
  to.cameras = from.cameras, to.calibration = from.calibration, to.object = from.object;
}

std::string recorded_calibration(const std::string& text) {
  const std::size_t begin = text.find("\ncameras:");
  return begin == std::string::npos ? "" : text.substr(begin + 1);
}

bool calibration_is_as_recorded(const std::filesystem::path& file, const SessionInfo& info) {
  const std::string calibration = recorded_calibration(read_whole_file(file));
  return !calibration.empty() && sha256_of_text(calibration) == info.calibration_hash;
}

}  // namespace tankrig
