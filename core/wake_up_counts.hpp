// How late the cycle's steps begin, for whoever looks on while it runs; CycleTimes has it finely afterwards.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/time.hpp"

namespace tankrig {

/// Counts in bins, four to a doubling: below 1 us, 1.25, 1.5, 1.75, 2, 2.5, ... 32.768 ms, and all beyond.
/// Threads: add() one; seen() any, at the same time.
/// RT: add().
class WakeUpCounts {
 public:
  static constexpr std::size_t kBins = 62;
  struct Seen {
    std::array<std::uint64_t, kBins> counts{};
    Duration longest{};
  };
  /// Exclusive, in microseconds; of the last bin there is none.
  static constexpr double upper_us(std::size_t bin) noexcept {
    return bin == 0 ? 1 : 0.25 * static_cast<double>((4 + (bin - 1) % 4 + 1) << ((bin - 1) / 4));
  }

  void add(Duration late) noexcept {
    const std::int64_t ns = std::max<std::int64_t>(late.count(), 0);
    std::atomic<std::uint64_t>& bin = counts_[bin_of(ns)];
    bin.store(bin.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);  // nobody else writes
    if (ns > longest_.load(std::memory_order_relaxed)) longest_.store(ns, std::memory_order_relaxed);
  }

  /// Of steps that are made meanwhile, some may be missing.
  Seen seen() const noexcept {
    Seen out;
    for (std::size_t i = 0; i < kBins; ++i) out.counts[i] = counts_[i].load(std::memory_order_relaxed);
    out.longest = Duration{longest_.load(std::memory_order_relaxed)};
    return out;
  }

 private:
  static constexpr std::size_t bin_of(std::int64_t ns) noexcept {
    const auto quarters = static_cast<std::uint64_t>(ns / 250);  // of a microsecond
    if (quarters < 4) return 0;
    const auto doublings = static_cast<std::size_t>(std::bit_width(quarters)) - 3;
    return std::min<std::size_t>(1 + 4 * doublings + (quarters >> doublings) - 4, kBins - 1);
  }

  std::array<std::atomic<std::uint64_t>, kBins> counts_{};
  std::atomic<std::int64_t> longest_{0};
};

}  // namespace tankrig
