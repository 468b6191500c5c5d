// Answers that come too late to tell when the encoders were read.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <limits>
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

/// 60 ms in which nothing is answered, and then all of it at once.
TEST_F(LateAnswers, AreAsManyAsRequestsWereGivenUp) {
  for (int asked = 0; asked < 3; ++asked) {
    ask();
    bench.pass(bench.settings.reply_timeout);
  }
  for (const int given_up : {1, 2}) {
    EXPECT_FALSE(answered()) << "the answer to request " << given_up;
    EXPECT_EQ(late(), before + given_up);
  }
  EXPECT_TRUE(answered()) << "the one that was still waited for";
  EXPECT_EQ(late(), before + 2);
  EXPECT_TRUE(exchange(1ms));
}

TEST_F(LateAnswers, AreExpectedForATimeOnly) {
  for (const bool over : {false, true}) {
    ask();
    bench.pass(bench.settings.reply_timeout + 10ms);
    bench.bus->room = bench.bus->sent.size();
    ask();  // the first is given up, and nothing is asked anew
    bench.bus->room = 1000;
    bench.pass(GivenUp::kLatest - bench.arm->exchange_period() + (over ? 1ms : -1ms));
    EXPECT_EQ(exchange(0ms), over);
    EXPECT_EQ(late(), before + 1);
    EXPECT_TRUE(exchange(0ms));
  }
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

/// An arm that answers every whole request so much later, one after the other, but for those it loses.
class SlowArm {
 public:
  SlowArm(Duration latency, int loses_every) : latency_(latency), loses_every_(loses_every) {
    bench.bus->room = std::numeric_limits<std::size_t>::max();
  }

  /// The cycle, for so long; stops at an error.
  void run(Duration time) {
    const Stamp end = bench.clock.now() + time;
    while (bench.clock.now() < end && std::string_view(error.where).empty()) {
      answer_what_is_due();
      bench.pass(1ms);
      if (++ms_ % 10 != 0) continue;
      const auto news = bench.arm->try_read();
      if (!news.ok()) error = news.error();
      if (news.ok() && news.value()) {
        if (readings > 0) longest_gap = std::max(longest_gap, bench.clock.now() - newest_);
        newest_ = bench.clock.now();
        ++readings;
      }
      (void)bench.arm->write_ticks({});
    }
  }

  StillArm bench;
  Error error;
  int readings = 0;
  Duration longest_gap{};

 private:
  struct Due {
    Stamp when;
    bool gains;
  };

  void answer_what_is_due() {
    const auto& sent = bench.bus->sent;
    for (; seen_ < sent.size(); ++seen_) {
      const bool gains = sent[seen_].id == bench.settings.can_ids.pid.back();
      if (!gains && sent[seen_].id != bench.settings.can_ids.demand.back()) continue;
      if (loses_every_ > 0 && ++requests_ % loses_every_ == 0) continue;
      due_.push_back({bench.clock.now() + latency_, gains});
    }
    for (; !due_.empty() && due_.front().when <= bench.clock.now(); due_.pop_front())
      due_.front().gains ? bench.acknowledge() : bench.answer(1234);
  }

  const Duration latency_;
  const int loses_every_;
  std::deque<Due> due_;
  std::size_t seen_ = 0;
  int ms_ = 0, requests_ = 0;
  Stamp newest_{};
};

/// Nothing in an answer says to which request it is: the driver finds out by waiting.
TEST(SlowArm, IsSilentAndNotPunctualBecauseARequestIsOutstandingWhenItsAnswersCome) {
  for (Duration latency = 26ms; latency <= 60ms; latency += 1ms) {
    SlowArm arm(latency, 0);
    arm.run(2s);
    EXPECT_STREQ(arm.error.where, "arm: silent") << latency / 1ms << " ms";
    EXPECT_LE(arm.readings, 2) << latency / 1ms << " ms";
  }
}

TEST(SlowArm, IsNotTakenForOneThatLosesAnAnswerNowAndThen) {
  for (const int every : {5, 10, 20}) {
    SlowArm arm(1ms, every);
    arm.run(5s);
    EXPECT_STREQ(arm.error.where, "") << "one in " << every;
    EXPECT_LE(arm.longest_gap, 100ms) << "one in " << every;
  }
}

}  // namespace
}  // namespace tankrig
