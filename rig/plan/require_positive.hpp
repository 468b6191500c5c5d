// Settings that must be above zero.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

#include "core/input_error.hpp"

namespace tankrig {

/// Errors: InputError that names the setting.
inline void require_positive(const std::string& setting, double value) {
  if (value > 0 && std::isfinite(value)) return;
  char number[32];
  std::snprintf(number, sizeof number, "%g", value);
  throw InputError(setting + ": found " + number + ", expected a positive number");
}

}  // namespace tankrig
