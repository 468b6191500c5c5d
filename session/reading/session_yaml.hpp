// session.yaml: everything about a session except its samples.
#pragma once

#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

#include "core/config_node.hpp"
#include "core/settings_table.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// The cameras, the calibration and the object as session.yaml writes them.
std::string calibration_yaml(const SessionInfo& info);

/// Whole text of session.yaml, calibration hash included.
std::string session_yaml(const SessionInfo& info);
/// The same with the given `calibration` text and the hash in `info`: a pose that is read and written again may be
/// another text.
std::string session_yaml(const SessionInfo& info, const std::string& calibration);

/// Errors: InputError with file, line and field.
SessionInfo read_session_yaml(const std::filesystem::path& file);

/// The keys before the calibration, in file order; each can be read by itself.
extern const SettingsTable<SessionInfo> kSessionKeys;

/// What calibration_yaml() wrote; `file` is for the message.
/// Errors: InputError; then `info` is unchanged.
void read_calibration_yaml(const std::string& text, const std::filesystem::path& file, SessionInfo& info);
void take_calibration(const SessionInfo& from, SessionInfo& to);

/// The calibration in the text of a session.yaml, to the letter; empty if there is none.
std::string recorded_calibration(const std::string& text);

/// A whole number, possibly larger than a double holds exactly.
/// Errors: InputError with file, line and field.
template <class Whole>
Whole read_whole(const ConfigNode& node, const std::string& key) {
  const std::string text = node.text(key);
  Whole value{};
  if (!parse_number(text, value))
    node.fail(key, "found '" + shown_text(text) + "', expected a whole number" +
                       (std::is_unsigned_v<Whole> ? " of at least 0" : ""));
  return value;
}

/// Whether the calibration in `file` is, to the letter, the one that was hashed.
bool calibration_is_as_recorded(const std::filesystem::path& file, const SessionInfo& info);

}  // namespace tankrig
