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

/// A row per figure of the reference module.
std::string uwsim_table(const nlohmann::json& score);

/// "sync residual: ... ms, ... mm on the target; sigma of the stamps ... ms" in a line, of a scan's statistics.
std::string sync_line(const Statistics& sync);

}  // namespace tankrig::app
