// One number that a calibration found, and how well it is known.
#pragma once

#include <string>

namespace tankrig {

/// One estimated number.
struct Estimate {
  std::string name;
  std::string unit;  ///< "rad", "m", "px" or none, of the next three
  double value = 0;
  double sigma = 0;       ///< one standard deviation
  double half_width = 0;  ///< of the 95 % interval
  double effect = 0;      ///< how far `sigma` moves the target [m]
};

/// Student's t: the 95 % interval is +- this many sigmas. Infinite without a degree of freedom.
double interval_factor(double degrees_of_freedom);

}  // namespace tankrig
