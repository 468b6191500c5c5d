// Answers that come too late to tell when the encoders were read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string_view>
#include <utility>

#include "tests/arm/still_arm.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::StillArm;

class LateAnswers : public ::testing::Test {
 protected:
  LateAnswers() {
    bench.acknowledge();
    for (int i = 0; i < 8; ++i) (void)exchange(1ms);  // until its encoders are believed
    EXPECT_TRUE(exchange(1ms));
    before = late();
  }

  void ask() {
    bench.pass(bench.arm->exchange_period());
    EXPECT_TRUE(drive_ticks(*bench.arm, {}).ok());
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
  EXPECT_FALSE(exchange(1ms)) << "it may be so late that the next request was on its way";
  EXPECT_EQ(late(), before + 2);
  EXPECT_TRUE(exchange(1ms));
  EXPECT_EQ(late(), before + 2);
}

/// Three answer times, of which the wire's part is 3 ms.
TEST_F(LateAnswers, AreWaitedForBeforeTheNextRequest) {
  ask();
  const std::size_t asked = bench.bus->sent.size();
  for (const bool over : {false, true}) {
    bench.pass(over ? bench.arm->exchange_period() : 3 * bench.settings.reply_timeout);
    EXPECT_FALSE(bench.arm->try_read().value());
    EXPECT_TRUE(drive_ticks(*bench.arm, {}).ok());
    EXPECT_EQ(bench.bus->sent.size() > asked, over);
  }
  EXPECT_FALSE(answered()) << "it may be to the one before";
  EXPECT_EQ(late(), before + 1);
  EXPECT_TRUE(exchange(1ms));
}

TEST_F(LateAnswers, AreThoseThatNobodyAskedFor) {
  EXPECT_TRUE(exchange(1ms));
  EXPECT_FALSE(answered());
  EXPECT_EQ(late(), before + 1);
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

/// An arm that answers every whole request so much later, one after the other; but for those it loses, and those after
/// which it is mute until a different one comes.
class OddArm {
 public:
  explicit OddArm(std::function<Duration()> answers_after) : latency(std::move(answers_after)) {
    bench.bus->room = std::numeric_limits<std::size_t>::max();
    seen_ = bench.bus->sent.size();
    bench.acknowledge();
  }
  explicit OddArm(Duration after) : OddArm([after] { return after; }) {}

  /// The cycle, for so long; stops at an error.
  void run(Duration time) {
    const Stamp end = bench.clock.now() + time;
    while (bench.clock.now() < end && std::string_view(error.where).empty()) {
      bench.pass(1ms);
      answer_what_is_due();
      if (++ms_ % 10 != 0) continue;
      const auto news = bench.arm->try_read();
      if (!news.ok()) error = news.error();
      if (news.ok() && news.value()) take();
      (void)(stops ? bench.arm->stop() : drive_ticks(*bench.arm, {0, 0, 1000, 0, 0}));
      answer_what_is_due();
    }
  }

  StillArm bench;
  std::function<Duration()> latency;
  std::function<bool(int)> loses = [](int) { return false; }, mutes = loses;  ///< by the number of the request
  bool stops = false;
  int requests = 0;
  bool at_rest = true;  ///< by the newest request that it heard
  Error error;
  int readings = 0;
  Duration longest_gap{};
  Duration latest{};  ///< of all readings

 private:
  using Request = std::array<SlotBytes, kJoints>;
  struct Due {
    Stamp when;
    bool gains;
    Duration latency;
  };

  void take() {
    const Stamp now = bench.clock.now();
    if (readings++ > 0) longest_gap = std::max(longest_gap, now - newest_);
    newest_ = now;
    const double count = bench.arm->readings().temperature_c[0] / bench.settings.scaling.celsius_per_count;
    latest = std::max<Duration>(latest, std::lround(count) * 2ms);
  }

  void answer_what_is_due() {
    const auto& sent = bench.bus->sent;
    for (; seen_ + kJoints <= sent.size(); seen_ += kJoints) {
      Request request;
      for (std::size_t j = 0; j < kJoints; ++j) request[j] = sent[seen_ + j].data;
      ++requests;
      if (loses(requests) || request == mute_since_) continue;
      mute_since_.reset();
      if (mutes(requests)) {
        mute_since_ = request;
        continue;
      }
      const bool gains = sent[seen_].id == bench.settings.can_ids.pid[0];
      if (!gains) at_rest = request[kElbow][0] == 0;
      const Duration after = latency();
      due_.push_back({bench.clock.now() + after, gains, after});
    }
    for (; !due_.empty() && due_.front().when <= bench.clock.now(); due_.pop_front()) {
      std::array<std::uint16_t, kJoints> raw{};
      raw[kElbow] = static_cast<std::uint16_t>(20'000 + ms_);  // it moves
      const auto told = static_cast<std::uint8_t>(due_.front().latency / 2ms);
      due_.front().gains ? bench.acknowledge() : bench.answer(raw, told);
    }
  }

  std::deque<Due> due_;
  std::size_t seen_ = 0;
  std::optional<Request> mute_since_;
  int ms_ = 0;
  Stamp newest_{};
};

constexpr Duration kInTime = 25ms;  // the wire's 3 ms, the time-out, and that latencies are told in 2 ms

/// Nothing in an answer says to which request it is. A reading taken for punctual would be as late as its answer.
TEST(OddArm, ThatIsSlowIsSilentHoweverSlowFromTheBeginningOrFromSomeTimeOn) {
  for (Duration slow = 26ms; slow <= 400ms; slow += 1ms)
    for (const bool from_the_beginning : {true, false}) {
      OddArm arm(from_the_beginning ? slow : 1ms);
      arm.run(500ms);
      EXPECT_EQ(arm.readings > 40, !from_the_beginning);
      arm.latency = [slow] { return slow; };
      arm.run(2s);
      EXPECT_STREQ(arm.error.where, "arm: silent") << slow / 1ms << " ms";
      EXPECT_LE(arm.latest, kInTime) << slow / 1ms << " ms";
      EXPECT_EQ(arm.readings > 0, !from_the_beginning) << slow / 1ms << " ms";
    }
}

TEST(OddArm, ThatIsSlowNowMoreNowLessIsSilent) {
  for (unsigned seed = 1; seed <= 100; ++seed)
    for (const bool from_the_beginning : {true, false}) {
      std::mt19937 random(seed);
      std::uniform_int_distribution<int> ms(26, 60);
      OddArm arm(1ms);
      const auto slow = [&] { return ms(random) * 1ms; };
      if (from_the_beginning) arm.latency = slow;
      arm.run(500ms);
      arm.latency = slow;
      arm.run(2s);
      EXPECT_STREQ(arm.error.where, "arm: silent") << "seed " << seed;
      EXPECT_LE(arm.latest, kInTime) << "seed " << seed;
      EXPECT_EQ(arm.readings > 0, !from_the_beginning) << "seed " << seed;
    }
}

/// Which looks the same until one more comes.
TEST(OddArm, ThatIsSlowIsNotTakenForOneThatLosesAnAnswerWhereItDidSoBefore) {
  for (Duration slow = 26ms; slow <= 60ms; slow += 1ms)
    for (Duration before = 10ms; before <= 400ms; before += 10ms) {
      OddArm arm(1ms);
      arm.run(500ms);
      arm.loses = [lost = arm.requests + 1](int request) { return request == lost; };
      arm.run(before);
      arm.latency = [slow] { return slow; };
      arm.run(2s);
      EXPECT_STREQ(arm.error.where, "arm: silent") << slow / 1ms << " ms, " << before / 1ms << " ms before";
      EXPECT_LE(arm.latest, kInTime) << slow / 1ms << " ms, " << before / 1ms << " ms before";
    }
}

/// Nothing is answered for a while, and then all of it at once.
TEST(OddArm, ThatPausesGoesOnAndNoReadingOfThePauseIsBelieved) {
  for (Duration pause = 10ms; pause <= 240ms; pause += 1ms)
    for (Duration offset{}; offset < 10ms; offset += 3ms) {
      OddArm arm(1ms);
      arm.run(500ms + offset);
      const Stamp end = arm.bench.clock.now() + pause;
      arm.latency = [&] { return std::max<Duration>(end - arm.bench.clock.now(), 1ms); };
      arm.run(pause);
      const int before = arm.readings;
      arm.run(110ms);
      EXPECT_GT(arm.readings, before) << pause / 1ms << " ms";
      EXPECT_STREQ(arm.error.where, "") << pause / 1ms << " ms";
      EXPECT_LE(arm.latest, kInTime) << pause / 1ms << " ms";
    }
}

/// As wide as a pair of readings may be that a frame's joints lie between, by default.
constexpr Duration kUsefulGap = 100ms;

TEST(OddArm, ThatLosesAnAnswerNowAndThenIsHeardAllTheSame) {
  for (const int every : {5, 10, 20}) {
    OddArm arm(1ms);
    arm.loses = [every](int request) { return request % every == 0; };
    arm.run(5s);
    EXPECT_STREQ(arm.error.where, "") << "one in " << every;
    EXPECT_LE(arm.longest_gap, kUsefulGap) << "one in " << every;
  }
}

TEST(OddArm, ThatIsMuteTwiceIsGivenADifferentRequestEachTime) {
  for (int second = 1; second <= 10; ++second) {
    OddArm arm(1ms);
    arm.run(500ms);
    arm.mutes = [first = arm.requests + 1, second](int request) {
      return request == first || request == first + second;
    };
    arm.run(2s);
    EXPECT_STREQ(arm.error.where, "") << second;
    EXPECT_LE(arm.longest_gap, 2 * kUsefulGap) << second;
  }
}

/// Whatever was lost or not heard before it.
TEST(OddArm, ThatIsMuteAtAStopIsStoppedByADifferentOne) {
  for (const bool loses : {true, false})
    for (Duration before{}; before <= 150ms; before += 1ms) {
      OddArm arm(1ms);
      arm.run(500ms);
      auto& odd = loses ? arm.loses : arm.mutes;
      odd = [first = arm.requests + 1](int request) { return request == first; };
      arm.run(before);
      ASSERT_FALSE(arm.at_rest);
      arm.mutes = [next = arm.requests + 1](int request) { return request == next; };
      arm.stops = true;
      EXPECT_TRUE(arm.bench.arm->stop().ok());
      arm.run(arm.bench.settings.reply_timeout + 15ms);
      EXPECT_TRUE(arm.at_rest) << (loses ? "lost " : "mute ") << before / 1ms << " ms before";
    }
}

}  // namespace
}  // namespace tankrig
