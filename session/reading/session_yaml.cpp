#include "session/reading/session_yaml.hpp"

#include <fmt/core.h>

#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/session_names.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace tankrig {
namespace {

constexpr const char* kFormat = "tankrig-session 1";
constexpr ConfigRange kLux{0, kMaxLux};
using Info = SessionInfo;
using Node = const ConfigNode&;
using Out = YAML::Emitter&;

const Setting<TableSpan> kSpanRows[] = {
    {"lines", &TableSpan::lines, "", Need::kRequired},
    {"first_ns", &TableSpan::first, "", Need::kRequired},
    {"last_ns", &TableSpan::last, "", Need::kRequired},
};
constexpr SettingsTable<TableSpan> kSpan{kSpanRows};

const Setting<CameraAccount> kAccountRows[] = {
    {"expected", &CameraAccount::expected, "", Need::kRequired},
    {"unaccounted", &CameraAccount::unaccounted, "", Need::kRequired},
};
constexpr SettingsTable<CameraAccount> kAccount{kAccountRows};

const Setting<ClockPair> kClockPairRows[] = {
    {"stamp_ns", &ClockPair::stamp, "", Need::kRequired},
    {"wall_ns", &ClockPair::wall_ns, "", Need::kRequired},
};
constexpr SettingsTable<ClockPair> kClockPair{kClockPairRows};

/// A mapping of names to values.
template <class T, class Write>
void write_map(YAML::Emitter& out, const std::map<std::string, T>& map, Write write) {
  out << (map.empty() ? YAML::Flow : YAML::Block) << YAML::BeginMap;
  for (const auto& [name, value] : map) {
    out << YAML::Key << YAML::DoubleQuoted << name << YAML::Value;
    write(value);
  }
  out << YAML::EndMap;
}

void read_format(Node n, const char* key, Info&) { static_cast<void>(n.choice(key, {kFormat})); }
void write_format(Out out, const Info&) { out << kFormat; }

void read_kind(Node n, const char* key, Info& i) { i.kind = n.choice(key, {"scan", "import"}); }
void write_kind(Out out, const Info& i) { out << YAML::DoubleQuoted << i.kind; }

void read_clock(Node n, const char* key, Info& i) {
  const ConfigNode clock = n.child(key);
  if (const auto begin = clock.optional_child("begin")) i.clock_begin = settings_from(*begin, kClockPair);
  if (const auto end = clock.optional_child("end")) i.clock_end = settings_from(*end, kClockPair);
}
void write_clock(Out out, const Info& i) {
  out << YAML::BeginMap << YAML::Key << "begin" << YAML::Value;
  write_mapping(out, kClockPair, *i.clock_begin, YAML::Flow);
  if (i.clock_end) {
    out << YAML::Key << "end" << YAML::Value;
    write_mapping(out, kClockPair, *i.clock_end, YAML::Flow);
  }
  out << YAML::EndMap;
}

void read_lux_source(Node n, const char* key, Info& i) { i.lux_source = n.choice(key, {"meter", "hand"}); }
void write_lux_source(Out out, const Info& i) { out << i.lux_source; }

void read_counts(Node n, const char* key, Info& i) {
  const ConfigNode counts = n.child(key);
  for (const std::string& reason : counts.keys())
    i.counts[reason] = read_value<std::uint64_t>(counts, reason.c_str(), {});
}
void write_counts(Out out, const Info& i) {
  write_map(out, i.counts, [&](std::uint64_t count) { out << std::to_string(count); });
}

/// What is unaccounted for follows from the counts, where they are there.
void read_account(Node n, const char* key, Info& i) {
  const ConfigNode cameras = n.child(key);
  for (const std::string& camera : cameras.keys()) {
    CameraAccount& account = i.account[camera] = settings_from(cameras.child(camera), kAccount);
    if (i.counts.contains(camera + ".recorded")) account.unaccounted = unaccounted(i.counts, camera, account.expected);
  }
}
void write_account(Out out, const Info& i) {
  write_map(out, i.account, [&](const CameraAccount& account) { write_mapping(out, kAccount, account, YAML::Flow); });
}

void read_devices(Node n, const char* key, Info& i) {
  const ConfigNode devices = n.child(key);
  for (const std::string& name : devices.keys()) i.devices[name] = devices.number(name);
}
void write_devices(Out out, const Info& i) {
  write_map(out, i.devices, [&](double value) { out << exact_text(value); });
}

void read_timing(Node n, const char* key, Info& i) { i.timing = settings_from(n.child(key), kSessionTimingKeys); }
void write_timing(Out out, const Info& i) { write_mapping(out, kSessionTimingKeys, *i.timing); }

void read_platform(Node n, const char* key, Info& i) {
  const ConfigNode platform = n.child(key);
  for (const std::string& what : platform.keys()) i.platform[what] = platform.text(what);
}
void write_platform(Out out, const Info& i) {
  write_map(out, i.platform, [&](const std::string& found) { out << YAML::DoubleQuoted << found; });
}

void read_tables(Node n, const char* key, Info& i) {
  const ConfigNode tables = n.child(key);
  for (const std::string& name : tables.keys()) i.tables[name] = settings_from(tables.child(name), kSpan);
}
void write_tables(Out out, const Info& i) {
  write_map(out, i.tables, [&](const TableSpan& span) { write_mapping(out, kSpan, span, YAML::Flow); });
}

void read_recovered(Node n, const char* key, Info& i) { i.recovered = n.texts(key); }
void write_recovered(Out out, const Info& i) {
  out << YAML::BeginSeq;
  for (const std::string& loss : i.recovered) out << YAML::DoubleQuoted << loss;
  out << YAML::EndSeq;
}

template <auto member>
bool is_there(const Info& i) {
  if constexpr (requires { (i.*member).empty(); })
    return !(i.*member).empty();
  else
    return (i.*member).has_value();
}

const Setting<Info> kSessionRows[] = {
    {"format", {read_format, write_format, kFormat}, "", Need::kRequired},
    {"name", &Info::name, "", Need::kRequired},
    {"status", &Info::status, "", Need::kRequired},
    {"kind", {read_kind, write_kind, ""}, "", Need::kRequired},
    {"created_utc", &Info::created_utc, "", Need::kRequired},
    {"clock", {read_clock, write_clock, "", nullptr, is_there<&Info::clock_begin>}},
    {"operator", &Info::operator_name, "", Need::kRequired},
    {"notes", &Info::notes, "", Need::kRequired},
    {"commission", &Info::commission, "", Need::kSparse},
    {"rig", &Info::rig, "", Need::kRequired},
    {"rig_sha256", &Info::rig_hash, "", Need::kRequired},
    {"software", &Info::software, "", Need::kRequired},
    {"noise", &Info::noise, "", Need::kRequired},
    {"seed", &Info::seed, "", Need::kRequired},
    {"light", &Info::light, ConfigRange(0, 1), ""},
    {"truth_seed", &Info::truth_seed, ""},
    {"lux_source", {read_lux_source, write_lux_source, "", nullptr, is_there<&Info::lux_source>}},
    {"lux_before", &Info::lux_before, kLux, ""},
    {"lux_after", &Info::lux_after, kLux, ""},
    {"lux_uncertainty", &Info::lux_uncertainty, kLux, ""},
    {"simulated_s", &Info::simulated_s, ConfigRange(0, 1e9), ""},
    {"counts", {read_counts, write_counts, ""}, "", Need::kRequired},
    {"account", {read_account, write_account, "", nullptr, is_there<&Info::account>}},
    {"devices", {read_devices, write_devices, "", nullptr, is_there<&Info::devices>}},
    {"timing", {read_timing, write_timing, "", nullptr, is_there<&Info::timing>}},
    {"platform", {read_platform, write_platform, "", nullptr, is_there<&Info::platform>}},
    {"tables", {read_tables, write_tables, "", nullptr, is_there<&Info::tables>}},
    {"recovered", {read_recovered, write_recovered, "", nullptr, is_there<&Info::recovered>}},
    {"calibration_sha256", &Info::calibration_hash, "", Need::kRequired},
};

void read_arm(Node n, const char* key, SessionCalibration& c) { c.arm = settings_from(n.child(key), kArmModelKeys); }
void write_arm(Out out, const SessionCalibration& c) { emit(out, *c.arm); }

using Calibration = SessionCalibration;
const Setting<Calibration> kCalibrationRows[] = {
    {"arm", {read_arm, write_arm, "", nullptr, [](const Calibration& c) { return c.arm.has_value(); }}},
    {"ePl", &Calibration::ePl, ""},
    {"laser_origin_e_m", &Calibration::laser_origin_e, "", Need::kRequired},
    {"laser_direction_e", &Calibration::laser_direction_e, "", Need::kRequired},
    {"laser_fan_rad", &Calibration::laser_fan, ConfigRange(0, 3.2), "", Need::kRequired},
};
void check_laser(Node n, const Calibration& c) {
  if (c.ePl) check_laser_reach(n, "laser_origin_e_m", *c.ePl, c.laser_origin_e);
}
constexpr SettingsTable<Calibration> kCalibration{kCalibrationRows, check_laser};

const Setting<SessionObject> kObjectRows[] = {
    {"mesh", &SessionObject::mesh, "", Need::kRequired},
    {"bMo", &SessionObject::bMo, "", Need::kRequired},
};
void check_object(Node n, const SessionObject& object) {
  if (!is_file_name(object.mesh))
    n.fail("mesh", "found '" + shown_text(object.mesh) + "', expected the name of a file in the session");
}
constexpr SettingsTable<SessionObject> kObject{kObjectRows, check_object};

void read_cameras(Node n, const char* key, Info& i) {
  for (const ConfigNode& camera : n.items(key)) i.cameras.push_back(settings_from(camera, kCalibratedCameraKeys));
}
void write_cameras(Out out, const Info& i) {
  out << (i.cameras.empty() ? YAML::Flow : YAML::Block) << YAML::BeginSeq;
  for (const CalibratedCamera& camera : i.cameras) write_mapping(out, kCalibratedCameraKeys, camera);
  out << YAML::EndSeq;
}

void read_object(Node n, const char* key, Info& i) { i.object = settings_from(n.child(key), kObject); }
void write_object(Out out, const Info& i) { write_mapping(out, kObject, *i.object); }

const Setting<Info> kCalibratedRows[] = {
    {"cameras", {read_cameras, write_cameras, ""}, "", Need::kRequired},
    {"calibration", &Info::calibration, kCalibration},
    {"object", {read_object, write_object, "", nullptr, is_there<&Info::object>}},
};
constexpr SettingsTable<Info> kCalibrated{kCalibratedRows};

std::string text_of(const SettingsTable<Info>& table, const SessionInfo& info) {
  YAML::Emitter out;
  write_mapping(out, table, info);
  return std::string(out.c_str()) + "\n";
}

}  // namespace

constinit const SettingsTable<SessionInfo> kSessionKeys{kSessionRows};

std::string calibration_yaml(const SessionInfo& info) { return text_of(kCalibrated, info); }

std::string session_yaml(const SessionInfo& info, const std::string& calibration) {
  return text_of(kSessionKeys, info) + calibration;
}

std::string session_yaml(const SessionInfo& info) {
  const std::string calibration = calibration_yaml(info);
  SessionInfo hashed = info;
  hashed.calibration_hash = sha256_of_text(calibration);
  return session_yaml(hashed, calibration);
}

SessionInfo read_session_yaml(const std::filesystem::path& file) {
  const ConfigNode root = ConfigNode::load(file);
  SessionInfo info;
  read_settings(root, kSessionKeys, info);
  read_settings(root, kCalibrated, info);
  root.finish();
  return info;
}

void read_calibration_yaml(const std::string& text, const std::filesystem::path& file, SessionInfo& info) {
  const ConfigNode root = ConfigNode::parse(text, file);
  SessionInfo read;
  read_settings(root, kCalibrated, read);
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
