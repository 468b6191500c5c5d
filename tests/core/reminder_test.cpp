// What is said again and again, and no more after its end.
#include "core/reminder.hpp"

#include <gtest/gtest.h>

#include <future>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

TEST(Reminder, SaysItAgainAndAgainFromAThreadOfItsOwn) {
  std::promise<void> third;
  int said = 0;
  const std::thread::id here = std::this_thread::get_id();
  const Reminder sut(1ns, 1ns, [&] {
    EXPECT_NE(std::this_thread::get_id(), here);
    if (++said == 3) third.set_value();
  });
  third.get_future().wait();
}

TEST(Reminder, SaysNothingThatIsNotYetDueAndEndsAtOnce) {
  bool said = false;
  {
    const Reminder sut(24h, 24h, [&] { said = true; });
  }
  EXPECT_FALSE(said);
}

}  // namespace
}  // namespace tankrig
