// A session opened with its tables, and all that is wrong with it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/joint_state.hpp"
#include "session/reading/session_tables.hpp"

namespace tankrig {

struct OpenedSession {
  Session session;  ///< `warnings` and `all_there` speak of its tables and its seal too
  std::vector<JointState> joints;
  std::vector<SessionEvent> events;
  std::vector<std::string> unlike_seal;  ///< files that are not as they were sealed
};

/// Its warnings tell of cut, short or unreadable tables, an edited calibration, and files that are not as they were
/// sealed.
/// Errors: InputError if it cannot be used at all.
OpenedSession open_session(const std::filesystem::path& path);

}  // namespace tankrig
