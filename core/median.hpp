// The value in the middle of many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace tankrig {

/// Of an even number of values the upper one of the middle two. Reorders `values`, of which there is at least one.
template <class T>
T upper_median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tankrig
