// What the cycle calls takes no memory.
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include "tests/can/can_support.hpp"
#include "tests/support/counting_new.hpp"
#include "tests/support/sanitizers.hpp"

namespace tankrig {
namespace {

using namespace can_test;

TEST(CanInTheCycle, TakesNoMemoryInGoodTimesAndBad) {
  TANKRIG_SKIP_SANITIZED(testing_support::kNoCounting);
  MonotonicClock clock;
  auto [a, b] = make_can_pair(clock);
  const int raw = b->descriptor();
  const can_frame foreign = raw_frame(0x1234567 | CAN_EFF_FLAG), error = raw_error(CAN_ERR_BUSOFF);
  const auto before = testing_support::allocations();
  for (int i = 0; i < 100; ++i) {
    (void)a->try_send(numbered(1, i));
    (void)b->try_receive();
    (void)a->try_receive();
  }
  send_raw(raw, foreign);
  send_raw(raw, error);
  (void)a->try_receive();
  (void)a->try_send(numbered(1, 0));
  while (a->try_send(numbered(1, 0)).error().os_errno != ENOBUFS) {
  }
  (void)a->counters();
  b = nullptr;
  for (int i = 0; i < 1000; ++i) (void)a->try_receive();
  (void)a->try_send(numbered(1, 0));
  EXPECT_EQ(testing_support::allocations() - before, 0u);
  EXPECT_EQ(a->state(), CanState::kGone);
}

}  // namespace
}  // namespace tankrig
