// A sweep's results on disk: a line per configuration as it comes, tables made of them at the end.
//
//   points.jsonl   first line: what was run (benchmark, rig, software, hashes); then one line per configuration
//   results.csv    a row per configuration, units in the header
//   results.json   the same and all there is about each, with what was run
//   logs/NAME.csv  the log of each measure that has one, a block of rows per configuration
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/benchmark/benchmark.hpp"

namespace tankrig {

/// Configurations by number. One is {"values": [...], "measures": {NAME: {DETAIL: number or null, ...}}, "functions":
/// {NAME: number or null}, "simulated_s"}, or {"values": [...], "error": text}. A measure whose algorithm failed has an
/// "error" of its own beside the values of an empty cloud.
using PointRows = std::map<std::size_t, nlohmann::ordered_json>;

/// What failed in a configuration, measure by measure or as a whole; empty: nothing.
std::string point_error(const nlohmann::ordered_json& row);

/// The lines of the loops that a run left out, among what was run.
inline constexpr const char* kLoopsLeftOut = "loops_left_out";

/// The options beyond rig, preset, sensor and seed that a run was given, among what was run: "--noise 0.02".
inline constexpr const char* kOptions = "options";

/// A benchmark as that run had it: without those loops.
void drop_loops_left_out(Benchmark& benchmark, const nlohmann::ordered_json& run);

/// Errors: InputError if `folder`, which holds results of `before`, is of another run than `run`.
void check_run(const std::filesystem::path& folder, const nlohmann::ordered_json& before,
               const nlohmann::ordered_json& run);

/// The growing file. A line that was cut is left out, and its configuration is done again.
/// Threads: any.
class PointStore {
 public:
  /// Creates the folder, or goes on with one whose first line is the same `run`.
  /// Errors: InputError if it holds another run, or a line is none of ours.
  PointStore(const std::filesystem::path& folder, const nlohmann::ordered_json& run);
  ~PointStore();
  PointStore(const PointStore&) = delete;
  PointStore& operator=(const PointStore&) = delete;

  const PointRows& rows() const { return rows_; }
  std::size_t reused() const { return reused_; }
  std::uintmax_t bytes() const { return std::filesystem::file_size(file_); }  ///< of the file
  /// On disk when it returns.
  void add(std::size_t point, nlohmann::ordered_json row);

 private:
  std::mutex mutex_;
  PointRows rows_;
  std::size_t reused_ = 0;
  std::filesystem::path file_;
  int descriptor_ = -1;
};

/// Reads a folder's points.jsonl: what was run, and its rows.
/// Errors: InputError.
std::pair<nlohmann::ordered_json, PointRows> read_points(const std::filesystem::path& folder);

/// Writes results.csv, results.json and logs.
void write_result_tables(const std::filesystem::path& folder, const Benchmark& benchmark,
                         const nlohmann::ordered_json& run, const PointRows& rows);

}  // namespace tankrig
