// The figures that decide on a calibration, as they are printed.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "core/calibration_file.hpp"

namespace tankrig::app {

nlohmann::ordered_json checks_json(const std::vector<CalibrationCheck>& checks);
void print_checks(const std::vector<CalibrationCheck>& checks);

}  // namespace tankrig::app
