// Scores as people read them in a terminal.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/tankrig/command_line/progress.hpp"
#include "drivers/statistics.hpp"
#include "pipeline/score_session.hpp"

namespace tankrig::app {

/// A row per (method, score JSON): the paper's four figures first, each with its threshold or its ceiling.
std::string score_table(const std::vector<std::pair<std::string, nlohmann::json>>& scores);

/// A row per (method, score JSON) with coverage of the whole surface at each threshold.
std::string coverage_table(const std::vector<std::pair<std::string, nlohmann::json>>& scores);

/// A line for each method whose cloud may say little.
void warn_of(const std::vector<Score>& scores, Progress& progress);

/// `evaluate`'s table: the cloud as it was given and, below, as it lies best on the object, with the way from one to the
/// other.
std::string aligned_table(const nlohmann::json& score);

/// A row per figure of the reference module.
std::string uwsim_table(const nlohmann::json& score);

/// "moved by (x, y, z) mm, turned by a deg; N pairs (p %), rms r mm" of a registration's JSON.
std::string registration_line(const nlohmann::json& registration);

/// "sync residual: ... ms, ... mm on the target; sigma of the stamps ... ms" in a line, of a scan's statistics.
std::string sync_line(const Statistics& sync);

}  // namespace tankrig::app
