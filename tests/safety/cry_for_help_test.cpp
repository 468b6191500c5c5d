// What people are told to cut: at once, again, and when it is over.
#include "rig/safety/cry_for_help.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <vector>

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

/// What was told, by whichever thread.
class Told {
 public:
  CryForHelp::Tell tell() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line);
      news_.notify_all();
    };
  }
  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  std::vector<std::string> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    news_.wait(lock, [&] { return lines_.size() >= count; });
    return lines_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable news_;
  std::vector<std::string> lines_;
};

TEST(CryForHelp, IsHeardAtOnceAndOnceMoreWhenItIsOver) {
  Told told;
  CryForHelp sut(told.tell(), 24h);
  sut.cut("ARM");
  EXPECT_THAT(told.lines(), ElementsAre("ARM"));
  sut.cut("ARM");
  EXPECT_THAT(told.lines(), ElementsAre("ARM")) << "nothing new";
  sut.cut("LASER; ARM");
  sut.cut("");
  EXPECT_THAT(told.lines(), ElementsAre("ARM", "LASER; ARM", "confirmed now: laser off, arm at rest"));
}

TEST(CryForHelp, IsRepeatedWhateverItsCallerIsHeldUpBy) {
  Told told;
  CryForHelp sut(told.tell(), 1ms);
  sut.cut("ARM");
  const auto lines = told.wait_for(4);
  for (std::size_t i = 1; i < lines.size(); ++i) EXPECT_EQ(lines[i], "still: ARM");
  sut.cut("");
  EXPECT_EQ(told.lines().back(), "confirmed now: laser off, arm at rest");
}

TEST(CryForHelp, SaysAtTheEndWhatWasNeverConfirmed) {
  Told told;
  { CryForHelp(told.tell(), 24h).cut("ARM"); }
  EXPECT_THAT(told.lines(), ElementsAre("ARM", "the program ends, and it is not confirmed: ARM"));
}

TEST(CryForHelp, ThatNobodyNeedsSaysNothing) {
  Told told;
  { CryForHelp(told.tell(), 1ns).cut(""); }
  EXPECT_THAT(told.lines(), ElementsAre());
}

TEST(CryForHelp, ComesAgainEveryFewSeconds) {
  EXPECT_GE(CryForHelp::kAgain, 1s);
  EXPECT_LE(CryForHelp::kAgain, 5s);
}

}  // namespace
}  // namespace tankrig
