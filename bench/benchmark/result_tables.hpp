// The tables of a sweep, written row by row: none of them is in memory.
//
//   results.csv    a row per configuration, units in the header
//   results.json   the same and all there is about each, a configuration a line, with what was run
//   logs/NAME.csv  the log of each measure that has one, a block of rows per configuration
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "bench/benchmark/benchmark.hpp"

namespace tankrig {

class TableFile;

class ResultTables {
 public:
  /// `run`: what was run, as points.jsonl has it.
  /// Errors: CannotWrite.
  ResultTables(const std::filesystem::path& folder, const Benchmark& benchmark, const nlohmann::ordered_json& run);
  ~ResultTables();
  ResultTables(const ResultTables&) = delete;
  ResultTables& operator=(const ResultTables&) = delete;

  /// By rising number.
  /// Errors: InputError if the row's values are not those of the benchmark's loops: the file may be from elsewhere, and
  /// what follows takes them for the loops'.
  void add(std::size_t point, const nlohmann::ordered_json& row);
  /// Puts them in place, on the disk. Without it the old ones stay.
  void finish();

 private:
  struct Log {
    const Measure* measure;
    std::unique_ptr<TableFile> file;
  };

  const std::filesystem::path folder_;
  const Benchmark& benchmark_;
  std::unique_ptr<TableFile> csv_, json_;
  std::vector<Log> logs_;
  bool first_ = true;
};

}  // namespace tankrig
