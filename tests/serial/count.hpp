// What a device counted.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "drivers/statistics.hpp"

namespace tankrig {

/// Of a device's statistics, the one named.
template <class Device>
double count(const Device& device, const std::string& name) {
  for (const Statistic& s : device.statistics())
    if (s.name == name) return s.value;
  ADD_FAILURE() << "no statistic " << name;
  return -1;
}

}  // namespace tankrig
