// A session opened with its tables, and everything that is wrong with it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/joint_state.hpp"
#include "session/reading/session_tables.hpp"

namespace tankrig {

struct OpenedSession {
  Session session;  ///< `warnings` and `all_there` also cover its tables and its seal
  std::vector<JointState> joints;
  std::vector<SessionEvent> events;
  std::vector<std::string> unlike_seal;  ///< files that are not as they were sealed
};

/// Its warnings name tables that are cut, short or unreadable, an edited calibration, and files that differ from the
/// seal.
/// Errors: InputError if it cannot be used at all.
OpenedSession open_session(const std::filesystem::path& path);

}  // namespace tankrig
