// session.yaml: everything about a session but its samples.
#pragma once

#include <filesystem>
#include <string>

#include "rig/session/session.hpp"

namespace tankrig {

/// The cameras, the calibration and the object as session.yaml writes them.
std::string calibration_yaml(const SessionInfo& info);

/// Whole text of session.yaml, calibration hash included.
std::string session_yaml(const SessionInfo& info);

/// Errors: InputError with file, line and field.
SessionInfo read_session_yaml(const std::filesystem::path& file);

/// Whether the calibration in `file` is, to the letter, the one its hash was made of.
bool calibration_is_as_recorded(const std::filesystem::path& file, const SessionInfo& info);

}  // namespace tankrig
