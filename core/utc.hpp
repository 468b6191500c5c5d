// Wall time, for people: nothing computes with it.
#pragma once

#include <string>

namespace tankrig {

/// Now, as "2026-01-31T12:00:00Z".
std::string utc_now();

}  // namespace tankrig
