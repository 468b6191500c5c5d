#include "apps/tankrig/calibrate_all/checks_output.hpp"

#include <fmt/core.h>

namespace tankrig::app {

nlohmann::ordered_json checks_json(const std::vector<CalibrationCheck>& checks) {
  nlohmann::ordered_json out;
  for (const CalibrationCheck& c : checks)
    out.push_back({{"name", c.name}, {"value", c.value}, {"limit", c.limit}, {"unit", c.unit}, {"passed", c.passed()}});
  return out;
}

void print_checks(const std::vector<CalibrationCheck>& checks) {
  for (const CalibrationCheck& c : checks)
    fmt::print("  {:<32} {:>7.3f} {}, limit {:g}: {}\n", c.name, c.value, c.unit, c.limit,
               c.passed() ? "passed" : "failed");
}

}  // namespace tankrig::app
