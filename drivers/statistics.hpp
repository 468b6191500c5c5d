// A device's counts and measurements, for the session and the doctor.
#pragma once

#include <string>
#include <vector>

namespace tankrig {

struct Statistic {
  std::string name;  ///< lower_snake with unit suffix, e.g. "checksum_errors", "bus_load_percent"
  double value = 0;
};

/// In a fixed order, including zeros.
using Statistics = std::vector<Statistic>;

}  // namespace tankrig
