#include "rig/session/session_facts.hpp"

#include <charconv>
#include <map>

#include "rig/session/session_yaml.hpp"
#include "rig/session/sha256.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// What yaml_quoted() made of a text; nothing if it is cut.
std::optional<std::string> unquoted(std::string_view text) {
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') return std::nullopt;
  text = text.substr(1, text.size() - 2);
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\') {
      out += text[i];
      continue;
    }
    if (++i == text.size()) return std::nullopt;
    if (text[i] == 'n')
      out += '\n';
    else if (text[i] == 't')
      out += '\t';
    else if (text[i] == 'x' && i + 2 < text.size()) {
      unsigned char value = 0;
      std::from_chars(text.data() + i + 1, text.data() + i + 3, value, 16);
      out += static_cast<char>(value), i += 2;
    } else
      out += text[i];
  }
  return out;
}

/// The top-level "key: value" lines of a session.yaml, damaged or not, that are whole.
std::map<std::string, std::string> whole_lines(const std::string& text) {
  std::map<std::string, std::string> lines;
  for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const std::string line = text.substr(begin, end - begin);
    const std::size_t colon = line.find(": ");
    if (colon != std::string::npos && !line.starts_with(' '))
      lines.emplace(line.substr(0, colon), line.substr(colon + 2));
  }
  return lines;
}

/// Who, when and how, from the lines that are left.
SessionInfo facts_of(const std::string& text) {
  SessionInfo info;
  info.kind = "scan";
  const auto lines = whole_lines(text);
  const auto take = [&](const char* key, std::string& value) {
    if (const auto line = lines.find(key); line != lines.end()) value = unquoted(line->second).value_or(value);
  };
  take("name", info.name), take("status", info.status), take("kind", info.kind);
  take("created_utc", info.created_utc), take("operator", info.operator_name), take("notes", info.notes);
  take("rig", info.rig), take("rig_sha256", info.rig_hash), take("software", info.software), take("noise", info.noise);
  take("calibration_sha256", info.calibration_hash);
  const auto number = [&](const char* key) -> std::optional<double> {
    double value = 0;
    const auto line = lines.find(key);
    if (line == lines.end() || !parse_number(line->second, value)) return std::nullopt;
    return value;
  };
  if (const auto seed = lines.find("seed"); seed != lines.end()) parse_number(seed->second, info.seed);
  info.light = number("light"), info.lux_before = number("lux_before"), info.lux_after = number("lux_after");
  if (const auto source = lines.find("lux_source"); source != lines.end())
    if (source->second == "meter" || source->second == "hand") info.lux_source = source->second;
  info.simulated_s = number("simulated_s").value_or(0);
  if (info.kind != "import") info.kind = "scan";
  return info;
}

void take_calibration(const SessionInfo& from, SessionInfo& to) {
  to.cameras = from.cameras, to.calibration = from.calibration, to.object = from.object;
}

}  // namespace

void examine_session_yaml(const fs::path& session, const DescribeRig& describe, SessionFindings& out) {
  const fs::path file = session / "session.yaml";
  std::error_code ignored;
  const bool there = fs::is_regular_file(file, ignored);
  std::string why = there ? "" : "missing";
  try {
    if (there) {
      out.info = read_session_yaml(file);
      if (calibration_is_as_recorded(file, out.info)) {
        out.info_known = true;
        return;
      }
      why = "its calibration is not as recorded: its SHA-256 differs";
      out.info_known = true;
    }
  } catch (const InputError& e) {
    why = "cannot be read (" + std::string(e.what()).substr(session.string().size() + 1) + ")";
  }
  out.info_damaged = true;
  if (there && !out.info_known) out.info = facts_of(read_whole_file(file));
  const std::string recorded = out.info.calibration_hash;
  SessionInfo rig;
  try {
    if (describe) describe(session / "rig.yaml", rig);
  } catch (const InputError&) {
    rig = {};
  }
  const bool proven = !rig.cameras.empty() && sha256_of_text(calibration_yaml(rig)) == recorded;
  if (proven || (!out.info_known && !rig.cameras.empty())) {
    take_calibration(rig, out.info);
    if (out.info.rig.empty()) out.info.rig = rig.rig, out.info.rig_hash = rig.rig_hash;
    out.info_known = true;
    why += proven ? "; the recorded calibration is in rig.yaml (its SHA-256 is right)"
                  : "; cameras and calibration are taken from rig.yaml";
    if (out.info.status.empty()) why += "; when, by whom and in what light it was recorded is lost";
  }
  out.losses.push_back("session.yaml: " + why);
  if (out.info.name.empty()) out.info.name = fs::absolute(session).filename().string();
  if (out.info.status.empty()) out.info.status = "recording";
  if (out.info.kind.empty()) out.info.kind = "scan";
}

}  // namespace tankrig
