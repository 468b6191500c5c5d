// `tankrig serve score`: a cloud or an algorithm that somebody has sent, scored on a session.
#pragma once

#include "apps/tankrig/command_line/command_line.hpp"

namespace tankrig::app {

/// Below `tankrig serve`.
void add_score(CLI::App& serve, ChosenCommand& chosen);

/// Why no sandbox can be made here, and what to do; empty: one can.
std::string sandbox_trouble();

}  // namespace tankrig::app
