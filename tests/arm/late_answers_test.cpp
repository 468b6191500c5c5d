// Answers that come too late to tell when the encoders were read.
#include <gtest/gtest.h>

#include <string_view>

#include "tests/arm/still_arm.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::StillArm;

class LateAnswers : public ::testing::Test {
 protected:
  LateAnswers() {
    for (int i = 0; i < 6; ++i) {  // a request given up, the gains, then enough for its encoders to be believed
      ask();
      bench.acknowledge();
      answered();
    }
    EXPECT_TRUE(exchange(1ms));
    before = late();
  }

  void ask() {
    bench.pass(bench.arm->exchange_period());
    EXPECT_TRUE(bench.arm->write_ticks({}).ok());
  }
  bool answered() {
    bench.answer(1234);
    const auto news = bench.arm->try_read();
    EXPECT_TRUE(news.ok()) << news.error().where;
    return news.ok() && news.value();
  }
  /// Is an answer a reading, that comes so much after its request?
  bool exchange(Duration after) {
    ask();
    bench.pass(after);
    return answered();
  }
  double late() const {
    for (const Statistic& s : bench.arm->statistics())
      if (s.name == "late_answers") return s.value;
    ADD_FAILURE() << "not counted";
    return -1;
  }

  StillArm bench;
  double before = 0;
};

TEST_F(LateAnswers, AreNoReadingsAndCounted) {
  EXPECT_TRUE(exchange(bench.settings.reply_timeout));
  EXPECT_FALSE(exchange(bench.settings.reply_timeout + 10ms));
  EXPECT_EQ(late(), before + 1);
  EXPECT_TRUE(exchange(1ms));
  EXPECT_EQ(late(), before + 1);
}

/// Which request the first one answers nobody knows.
TEST_F(LateAnswers, AreWhatComesFirstAfterARequestWasGivenUp) {
  ask();
  bench.pass(bench.settings.reply_timeout + 10ms);
  EXPECT_FALSE(exchange(0ms));
  EXPECT_EQ(late(), before + 1);
  EXPECT_TRUE(exchange(0ms));
}

TEST_F(LateAnswers, AloneLeaveTheArmSilent) {
  const Stamp begin = bench.clock.now();
  Error error;
  while (std::string_view(error.where).empty() && bench.clock.now() - begin < 10s) {
    ask();
    bench.pass(bench.settings.reply_timeout + 10ms);
    bench.answer(1234);
    if (const auto news = bench.arm->try_read(); !news.ok()) error = news.error();
  }
  EXPECT_STREQ(error.where, "arm: silent");
  EXPECT_LE(bench.clock.now() - begin, bench.settings.silence_timeout + 100ms);
}

}  // namespace
}  // namespace tankrig
