// The rig file's `benchmark`: what benchmark files call things, and what this rig calls them.
#pragma once

#include <string>

#include "bench/benchmark/run_trace.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

/// Errors: InputError with file and line.
BenchmarkNames benchmark_names(const RigConfig& rig);

/// Every key of the section, as rows of a Markdown table.
std::string benchmark_key_rows();

}  // namespace tankrig::app
