// What a session holds, in a few lines: `tankrig session info`.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "session/reading/session.hpp"

namespace tankrig {

/// Facts in reading order: (what, value with its unit).
std::vector<std::pair<std::string, std::string>> session_summary(const Session& session);

}  // namespace tankrig
