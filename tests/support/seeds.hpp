// Tests that play chance many times: how many seeds, and what is expected of intervals.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace tankrig::testing_support {

/// `all` where TANKRIG_ALL_SEEDS is set, as it is for the studies of `./run test --all`; else a fifth of them, five at
/// least.
inline int seeds(int all) { return std::getenv("TANKRIG_ALL_SEEDS") ? all : std::max(5, all / 5); }

/// Of 95 % intervals, 90 to 99 % hold the truth; of fewer than 60, all may.
inline void expect_honest(int held, int intervals) {
  const double share = 100.0 * held / intervals;
  std::printf("%d of %d 95 %% intervals hold the truth (%.1f %%)\n", held, intervals, share);
  EXPECT_GE(share, 90);
  if (intervals >= 60) {
    EXPECT_LE(share, 99);
  }
}

}  // namespace tankrig::testing_support
