// A sweep as one page for a reviewer: figures, camera views, clouds, tables, and what makes it again.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/sweep/sweep_rows.hpp"

namespace tankrig {

/// Self-contained: nothing is loaded from anywhere. Its pictures are those of FOLDER/figures and FOLDER/views.jsonl that are
/// there. All text is escaped.
/// Errors: InputError naming a picture that cannot be read.
std::string sweep_html(const std::filesystem::path& folder, const Benchmark& benchmark,
                       const nlohmann::ordered_json& run, const SweepRows& rows);

}  // namespace tankrig
