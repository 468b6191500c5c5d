#include "core/range_words.hpp"

#include <cmath>
#include <sstream>

namespace tankrig {

std::string in_words(const ConfigRange& range) {
  std::ostringstream out;
  out.precision(8);
  const bool low = std::isfinite(range.lower), high = std::isfinite(range.upper);
  if (low && high)
    out << "a number from " << range.lower << " to " << range.upper;
  else if (low)
    out << "a number of at least " << range.lower;
  else if (high)
    out << "a number of at most " << range.upper;
  else
    out << "a number";
  return out.str();
}

}  // namespace tankrig
