// What an algorithm needs to be written once for a double and for four of them: each lane gets the bits of one alone.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {

/// What a comparison of `Real`, double or FourDoubles, gives; ?: takes it lane by lane.
template <class Real>
using Mask = std::conditional_t<std::is_same_v<Real, double>, bool, FourLongs>;

/// Four: wider comparisons are made one by one by GCC 12.
inline constexpr int kLanes = 4;

/// Of whatever holds lanes: their registers ask for it, and the compiler's own alignment is that of the narrowest.
inline constexpr std::size_t kLaneAlignment = kLanes * sizeof(double);

/// `Real`: a double, or four that follow each other.
template <class Real>
inline __attribute__((always_inline)) Real load(const double* values) {
  Real loaded;
  std::memcpy(&loaded, values, sizeof loaded);
  return loaded;
}

inline bool any(bool mask) { return mask; }

inline __attribute__((always_inline)) bool any(const FourLongs& mask) {
  std::int64_t all = 0;
  for (int i = 0; i < kLanes; ++i) all |= mask[i];
  return all != 0;
}

template <class Real>
inline __attribute__((always_inline)) Real size_of(const Real& x) {
  return x < 0 ? -x : x;
}

template <class Real>
inline __attribute__((always_inline)) Real clamped(const Real& x, double low, double high) {
  const Real none = {};
  const Real above = x < low ? none + low : x;
  return above > high ? none + high : above;
}

inline double root(double x) { return std::sqrt(x); }

inline __attribute__((always_inline)) FourDoubles root(const FourDoubles& x) {
  FourDoubles out;
  for (int i = 0; i < kLanes; ++i) out[i] = std::sqrt(x[i]);
  return out;
}

/// exp(x) to 1e-15 of it, for x from -700 to 700; beyond, that of the nearer end.
/// Source: Cody & Waite 1980, with Taylor's series on half of ln 2 to either side.
template <class Real>
inline __attribute__((always_inline)) Real exponential(const Real& power) {
  using Bits = std::conditional_t<std::is_same_v<Real, double>, std::int64_t, FourLongs>;
  constexpr double kLog2OfE = 0x1.71547652b82fep0, kLn2 = 0x1.62e42fefa38p-1, kLn2Rest = 0x1.ef35793c7673p-45;
  constexpr double kRounds = 0x1.8p52;  // added to a double, it leaves the whole number in the lowest bits
  constexpr int kMantissa = 52;
  const Real x = clamped(power, -700, 700);
  const Real shifted = x * kLog2OfE + kRounds, whole = shifted - kRounds;
  const Real rest = (x - whole * kLn2) - whole * kLn2Rest;
  // Pairs of powers at a time, so that no sum waits for the one before.
  const Real r2 = rest * rest, r4 = r2 * r2, r8 = r4 * r4;
  const Real low = (1 + rest) + r2 * (1.0 / 2 + rest * (1.0 / 6)),
             middle = (1.0 / 24 + rest * (1.0 / 120)) + r2 * (1.0 / 720 + rest * (1.0 / 5040)),
             high = (1.0 / 40320 + rest * (1.0 / 362880)) + r2 * (1.0 / 3628800 + rest * (1.0 / 39916800)) +
                    r4 * (1.0 / 479001600 + rest * (1.0 / 6227020800));
  const Real sum = (low + r4 * middle) + r8 * high;
  const Bits exponent = (std::bit_cast<Bits>(shifted) << kMantissa) + std::bit_cast<std::int64_t>(1.0);
  return sum * std::bit_cast<Real>(exponent);
}

}  // namespace tankrig
