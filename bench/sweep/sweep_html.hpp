// A sweep as one page for a reviewer: figures, camera views, clouds, tables, and what makes it again.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/benchmark/point_store.hpp"

namespace tankrig {

/// Self-contained: nothing is loaded from anywhere. Its pictures are those of FOLDER/figures that are there. All text is
/// escaped.
/// Errors: InputError naming a picture that cannot be read.
std::string sweep_html(const std::filesystem::path& folder, const Benchmark& benchmark,
                       const nlohmann::ordered_json& run, const PointRows& rows);

}  // namespace tankrig
