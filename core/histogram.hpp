// Durations counted in bins that widen with them: percentiles of millions of cycles in small, fixed memory.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/time.hpp"

namespace tankrig {

/// Log-linear bins as in HdrHistogram: every power of two has 64 equal ones, and below 128 ns each nanosecond has its
/// own. quantile() is never below the true value, and above it by less than 1/64 (1.6 %).
/// min and max are exact. Durations below zero count as zero; those beyond 68 s share one bin.
/// Threads: one.
/// RT: add() is safe; its memory is part of the object (17 kB).
class Histogram {
 public:
  /// Durations from `lower` to `upper`, both included, in nanoseconds.
  struct Bin {
    std::int64_t lower = 0, upper = 0;
    std::uint64_t count = 0;
  };

  void add(Duration value) noexcept {
    const std::int64_t ns = std::max<std::int64_t>(value.count(), 0);
    ++counts_[index_of(ns)];
    ++count_;
    sum_ += static_cast<double>(ns);
    min_ = std::min(min_, ns);
    max_ = std::max(max_, ns);
  }

  std::uint64_t count() const noexcept { return count_; }
  /// 0 if empty.
  Duration min() const noexcept { return Duration{count_ ? min_ : 0}; }
  Duration max() const noexcept { return Duration{max_}; }
  Duration mean() const noexcept {
    return Duration{count_ ? static_cast<std::int64_t>(sum_ / static_cast<double>(count_)) : 0};
  }

  /// The smallest duration that at least `share` of all do not exceed, rounded up to its bin's end; share in [0, 1].
  Duration quantile(double share) const noexcept {
    const double wanted = share * static_cast<double>(count_);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < kBins && count_ > 0; ++i) {
      seen += counts_[i];
      if (counts_[i] > 0 && static_cast<double>(seen) >= wanted)
        return Duration{i + 1 == kBins ? max_ : std::min(upper_of(i), max_)};
    }
    return max();
  }

  /// Calls each(Bin) for every bin that is not empty, in rising order.
  template <class Each>
  void for_each_bin(Each each) const {
    for (std::size_t i = 0; i < kBins; ++i)
      if (counts_[i] > 0) each(Bin{lower_of(i), upper_of(i), counts_[i]});
  }

 private:
  static constexpr int kSubBits = 6;   // 64 bins in a power of two
  static constexpr int kTopBits = 36;  // values below 2^36 ns
  static constexpr std::size_t kSub = std::size_t{1} << kSubBits;
  static constexpr std::size_t kBins = kSub * static_cast<std::size_t>(kTopBits - kSubBits + 1);

  static constexpr std::size_t index_of(std::int64_t ns) noexcept {
    const auto value = std::min(static_cast<std::uint64_t>(ns), (std::uint64_t{1} << kTopBits) - 1);
    if (value < 2 * kSub) return static_cast<std::size_t>(value);
    const int shift = std::bit_width(value) - 1 - kSubBits;
    return static_cast<std::size_t>(shift) * kSub + static_cast<std::size_t>(value >> shift);
  }
  static constexpr std::int64_t lower_of(std::size_t index) noexcept {
    if (index < 2 * kSub) return static_cast<std::int64_t>(index);
    const std::size_t shift = index / kSub - 1;
    return static_cast<std::int64_t>((index % kSub + kSub) << shift);
  }
  static constexpr std::int64_t upper_of(std::size_t index) noexcept { return lower_of(index + 1) - 1; }

  std::array<std::uint64_t, kBins> counts_{};
  std::uint64_t count_ = 0;
  double sum_ = 0;
  std::int64_t min_ = INT64_MAX, max_ = 0;
};

}  // namespace tankrig
