// Scores as people read them in a terminal.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "drivers/statistics.hpp"

namespace tankrig::app {

/// A row per (method, score JSON): the paper's four figures first, each with its threshold or its ceiling.
std::string score_table(const std::vector<std::pair<std::string, nlohmann::json>>& scores);

/// The reference module's figures, with its oddities below.
std::string uwsim_table(const nlohmann::json& score);

/// "sync residual: ... ms, ... mm on the target" in a line, of a scan's statistics.
std::string sync_line(const Statistics& sync);

}  // namespace tankrig::app
