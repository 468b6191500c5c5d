// session.yaml: everything about a session except its samples.
#pragma once

#include <filesystem>
#include <string>

#include "core/settings_table.hpp"
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

/// Whether the calibration in `file` is, to the letter, the one that was hashed.
bool calibration_is_as_recorded(const std::filesystem::path& file, const SessionInfo& info);

}  // namespace tankrig
