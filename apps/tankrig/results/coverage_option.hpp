// `--coverage 1,2,5,10`: other thresholds of coverage than those of the rig file.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "bench/metrics/metrics.hpp"

namespace tankrig::app {

/// Thresholds [m] of millimetres between commas.
/// Errors: InputError.
std::vector<double> parse_coverage(const std::string& millimetres);

/// `millimetres` stays empty if the option is not given. What parse_coverage() refuses is a wrong command line.
void add_coverage_option(CLI::App* command, std::string& millimetres);

/// Unchanged if `millimetres` is empty.
void set_coverage(MetricThresholds& thresholds, const std::string& millimetres);

}  // namespace tankrig::app
