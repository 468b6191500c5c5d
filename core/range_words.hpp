// What a number must be, in words for people.
#pragma once

#include <string>

#include "core/config_node.hpp"

namespace tankrig {

/// "a number from 0 to 0.1".
std::string in_words(const ConfigRange& range);

inline bool holds(const ConfigRange& range, double number) { return number >= range.lower && number <= range.upper; }

}  // namespace tankrig
