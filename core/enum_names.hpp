// The names that an enumeration's values have in files, in the order of the values.
#pragma once

#include <array>
#include <cstddef>

namespace tankrig {

/// Each enumeration that appears in files has template <> inline constexpr std::array kNames<E>{"first", ...} beside
/// it.
template <class E>
inline constexpr std::array<const char*, 0> kNames{};

template <class E>
constexpr const char* name_of(E value) {
  return kNames<E>[static_cast<std::size_t>(value)];
}

}  // namespace tankrig
