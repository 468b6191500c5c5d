// A sweep's results on disk: a line per configuration as it comes, tables made of them at the end (result_tables.hpp).
//
//   points.jsonl   first line: what was run (benchmark, rig, software, hashes); then one line per configuration
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/benchmark/benchmark.hpp"

namespace tankrig {

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

/// The rows of a folder's points.jsonl. They stay on the disk: in memory is where each begins.
///
/// A row is {"values": [...], "measures": {NAME: {DETAIL: number or null, ...}}, "functions": {NAME: number or null},
/// "simulated_s"}, or {"values": [...], "error": text}. A measure whose algorithm failed has an "error" of its own beside
/// the values of an empty cloud.
class PointRows {
 public:
  /// A line that was cut is left out. Of a configuration that is there twice the later one counts.
  /// Errors: InputError if there is no such file, or a line is none of ours.
  explicit PointRows(const std::filesystem::path& folder);

  const nlohmann::ordered_json& run() const { return run_; }
  std::size_t size() const { return places_.size(); }
  bool contains(std::size_t point) const { return places_.contains(point); }
  /// Errors: InputError if it cannot be read; std::out_of_range if there is none.
  nlohmann::ordered_json row(std::size_t point) const;
  /// In the order of their numbers.
  void for_each(const std::function<void(std::size_t, const nlohmann::ordered_json&)>& use) const;

 private:
  friend class PointStore;
  struct Place {
    std::uint64_t offset, length;
  };

  std::filesystem::path file_;
  nlohmann::ordered_json run_;
  std::map<std::size_t, Place> places_;
  std::uint64_t end_ = 0;  ///< of the last whole line
};

/// The growing file. A configuration whose line was cut is done again.
/// Threads: any may add().
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
  std::uintmax_t bytes() const { return rows_.end_; }  ///< of the file
  /// On disk when it returns.
  void add(std::size_t point, const nlohmann::ordered_json& row);
  /// Those that it lacks; on disk when it returns.
  void add(const PointRows& rows);

 private:
  void append(std::size_t point, std::string_view line);

  std::mutex mutex_;
  PointRows rows_;
  std::size_t reused_ = 0;
  int descriptor_ = -1;
};

}  // namespace tankrig
