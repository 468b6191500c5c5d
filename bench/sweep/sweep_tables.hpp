// A sweep's tables, as cells: over the whole grid, beside the paper's words, by the level of each curve.
#pragma once

#include <string>
#include <vector>

#include "bench/sweep/sweep_rows.hpp"

namespace tankrig {

struct SweepTable {
  std::string heading, note;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

/// None where there is no cloud or no loop.
std::vector<SweepTable> sweep_tables(const Benchmark& benchmark, const SweepRows& rows);

/// The sessions of an experiment, each with its light; no rows where the sweep has none.
SweepTable sessions_table(const SweepRows& rows);

/// The first configurations in which something failed: their loops' values, and what.
SweepTable failures_table(const Benchmark& benchmark, const SweepRows& rows);

}  // namespace tankrig
