// What `tankrig bench` leaves in its folder, and the same again from points.jsonl alone.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "bench/benchmark/point_store.hpp"

namespace tankrig::app {

/// Puts a copy of the benchmark file into the folder: its results can be read without anything else.
void keep_benchmark(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Tables, curves, results.md and report.html, with the pictures that the folder has. Returns in how many configurations
/// something failed.
/// Errors: InputError, where a row is not of the benchmark.
std::size_t write_results(const std::filesystem::path& folder, const Benchmark& benchmark, const PointRows& rows);

/// Puts the pictures that another folder of the same run has into this one, for write_results().
void take_pictures(const std::filesystem::path& folder, const std::filesystem::path& other, const Benchmark& benchmark);

/// Whether `folder` holds the results of a benchmark.
bool holds_benchmark(const std::filesystem::path& folder);

/// `tankrig report FOLDER` for such a folder: write_results() again. Returns the exit code: kPartial if configurations
/// are missing or failed.
/// Errors: InputError.
int report_benchmark(const std::filesystem::path& folder, bool json);

}  // namespace tankrig::app
