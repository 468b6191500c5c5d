// The value in the middle of many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace tankrig {

/// For an even count, the upper of the middle two. Reorders `values`, which must not be empty.
template <class T>
T upper_median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tankrig
