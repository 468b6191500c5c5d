// The cycle in real time: its grid, its times, what becomes of too many overruns.
#include "rig/executive/cycle.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "tests/support/fakes.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::CallLog;
using testing_support::FakeArm;
using testing_support::FakeLaser;

TEST(OverrunWindow, IsReachedByTheLastOfAsManyAsTheLimitWithinIt) {
  OverrunWindow sut(3, 100ms);
  EXPECT_FALSE(sut.add(Stamp{} + 0ms));
  EXPECT_FALSE(sut.add(Stamp{} + 60ms));
  EXPECT_FALSE(sut.add(Stamp{} + 120ms)) << "the first is out of the window";
  EXPECT_TRUE(sut.add(Stamp{} + 160ms));
  EXPECT_FALSE(sut.add(Stamp{} + 500ms));
}

TEST(OverrunWindow, OfOneIsReachedAtOnceAndOfZeroNever) {
  OverrunWindow one(1, 1ms), never(0, 1h);
  EXPECT_TRUE(one.add(Stamp{5}));
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(never.add(Stamp{i}));
}

/// Cycles that meet no sample, or more than one, of a device whose period differs by `drift`, after a while to settle.
int out_of_step(double drift, bool steered) {
  constexpr Duration kPeriod = 5ms, kWire = 700us;
  const Duration device = from_seconds(seconds(kPeriod) * (1 + drift));
  CycleGrid grid({}, kPeriod);
  PhaseLock phase(kPeriod);
  std::int64_t sample = 0;
  int out = 0;
  for (int cycle = 0; cycle < 40'000; ++cycle) {
    const Stamp now = grid.next() + Duration{(cycle * 7919) % 100'000};  // wakes up to 100 us late
    std::int64_t came = 0;
    while (Stamp{} + device * (sample + 1) + kWire <= now) ++sample, ++came;
    out += cycle > 1000 && came != 1;
    grid.advance(now);
    if (steered) grid.shift(phase.steer(now - (Stamp{} + device * sample)));
  }
  return out;
}

TEST(PhaseLock, KeepsStepWithADeviceOfItsOwnClockWhereAFixedGridDoesNot) {
  for (const double drift : {-2e-3, -2e-4, 2e-4, 2e-3}) {
    SCOPED_TRACE(drift);
    EXPECT_EQ(out_of_step(drift, true), 0);
    EXPECT_GT(out_of_step(drift, false), 5);
  }
}

TEST(PhaseLock, LeavesADeviceAloneThatAnswersWhenItIsAsked) {
  PhaseLock sut(5ms);
  for (int cycle = 0; cycle < 1000; ++cycle) EXPECT_EQ(sut.steer(3500us + Duration{(cycle * 7919) % 100'000}), 0ns);
}

/// Takes its time to be read, on the real clock.
class SlowArm final : public Arm {
 public:
  SlowArm(CallLog& log, const JointVector& q) : arm_(log, q) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    const MonotonicClock clock;
    for (const Stamp end = clock.now() + Duration{busy_ns.load()}; clock.now() < end;) continue;
    return arm_.try_read();
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override { return arm_.stop(); }
  Duration exchange_period() const noexcept override { return 1ms; }

  std::atomic<std::int64_t> busy_ns{0};

 private:
  FakeArm arm_;
};

struct Bench {
  static constexpr Duration kPeriod = 4ms;
  ScanSettings settings;
  ScanPlan plan;
  CallLog log;
  SlowArm arm;
  FakeLaser laser{log};
  MonotonicClock clock;
  Executive executive;
  Cycle cycle;
  CycleRecord last;

  static ScanSettings standing_still(int overruns) {
    ScanSettings s;
    s.park << 0, 0.12, 1.2, 0, 0.1;
    s.posture = s.park;
    s.control.feedback_timeout = 1e9;  // the fake arm's clock stands still
    s.real_time.overruns = overruns;
    s.real_time.window = 60;
    s.real_time.lock_memory = false;
    return s;
  }
  explicit Bench(int overruns)
      : settings(standing_still(overruns)),
        plan(make_scan_plan(settings, settings.park)),
        arm(log, settings.park),
        executive(plan, settings, arm, laser),
        cycle(executive, clock, kPeriod, settings.real_time) {}

  bool until(const std::function<bool()>& end, Duration deadline = 20s) {
    const Stamp give_up = clock.now() + deadline;
    while (!end() && clock.now() < give_up) {
      cycle.turn();
      CycleRecord record;
      while (executive.try_pop(record)) last = record;
    }
    return end();
  }
};

TEST(CycleInRealTime, KeepsItsPeriodOnTheGridAndItsTimes) {
  Bench bench(0);
  bench.cycle.begin();
  ASSERT_TRUE(bench.until([&] { return bench.cycle.cycles() >= 100; }));
  bench.cycle.end();
  ASSERT_TRUE(bench.cycle.times());
  const CycleTimes& times = *bench.cycle.times();
  EXPECT_EQ(times.cycles, bench.cycle.cycles());
  ASSERT_TRUE(bench.cycle.wake_ups());
  const WakeUpCounts::Seen seen = *bench.cycle.wake_ups();
  EXPECT_EQ(std::accumulate(seen.counts.begin(), seen.counts.end(), std::uint64_t{0}), times.cycles);
  EXPECT_EQ(seen.longest, times.wake_up.max());
  EXPECT_EQ(times.wake_up.count(), times.cycles);
  EXPECT_EQ(times.execution.count(), times.cycles);
  EXPECT_EQ(times.period.count(), times.cycles - 1);
  // What was late once is early the next time: the grid has no drift.
  const double points = static_cast<double>(times.cycles - 1 + times.missed_cycles);
  const double mean = seconds(times.period.mean()) * static_cast<double>(times.cycles - 1) / points;
  EXPECT_NEAR(mean, seconds(Bench::kPeriod), seconds(times.wake_up.max()) / points + 1e-6);
}

TEST(WakeUpCounts, HaveFourBinsToADoubling) {
  double upper_us = 1;
  for (std::size_t bin = 0; bin + 1 < WakeUpCounts::kBins; ++bin) {
    EXPECT_EQ(WakeUpCounts::upper_us(bin), upper_us);
    WakeUpCounts sut;
    const auto upper = Duration{static_cast<std::int64_t>(1000 * upper_us)};
    sut.add(upper - 1ns);
    sut.add(upper);
    EXPECT_EQ(sut.seen().counts[bin], 1u) << bin;
    EXPECT_EQ(sut.seen().counts[bin + 1], 1u) << bin;
    upper_us += std::exp2(std::floor(std::log2(upper_us))) / 4;
  }
  EXPECT_EQ(WakeUpCounts::upper_us(WakeUpCounts::kBins - 2), 32'768);
}

TEST(WakeUpCounts, KeepTheLongestAndWhatIsEarlyOrVeryLate) {
  WakeUpCounts sut;
  for (const Duration late : std::initializer_list<Duration>{-5ns, 5s, 32768us}) sut.add(late);
  EXPECT_EQ(sut.seen().counts.front(), 1u);
  EXPECT_EQ(sut.seen().counts.back(), 2u);
  EXPECT_EQ(sut.seen().longest, 5s);
}

TEST(CycleInRealTime, StopsSafelyAfterTooManyOverrunsLaserFirst) {
  Bench bench(5);
  bench.cycle.begin();
  ASSERT_TRUE(bench.until([&] { return bench.cycle.cycles() >= 10; }));
  EXPECT_NE(bench.last.state, ExecutiveState::kFault);
  bench.arm.busy_ns = (2 * Bench::kPeriod).count();
  ASSERT_TRUE(bench.until([&] { return bench.last.state == ExecutiveState::kFault; }));
  bench.arm.busy_ns = 0;
  bench.cycle.end();
  EXPECT_EQ(bench.last.fault, Fault::kOverrun);
  EXPECT_STREQ(bench.last.error.where, "cycle: too often late");
  EXPECT_GE(bench.cycle.overruns(), 5u);
  EXPECT_LT(bench.log.first("laser off"), bench.log.first("stop"));
  EXPECT_LT(bench.log.first("stop"), bench.log.count);
}

TEST(CycleInRealTime, OnlyCountsOverrunsWhereTheLimitIsZero) {
  Bench bench(0);
  bench.arm.busy_ns = (2 * Bench::kPeriod).count();
  bench.cycle.begin();
  ASSERT_TRUE(bench.until([&] { return bench.cycle.overruns() >= 20; }));
  bench.cycle.end();
  EXPECT_NE(bench.last.state, ExecutiveState::kFault);
  EXPECT_GE(bench.cycle.missed_cycles(), bench.cycle.overruns());
}

TEST(CycleInRealTime, KeepsTheProcessorsAwakeWhereItMay) {
  Bench bench(0);
  bench.cycle.begin();
  ASSERT_TRUE(bench.until([&] { return bench.cycle.cycles() > 0; }));
  EXPECT_EQ(bench.cycle.granted().processors_awake, ::access(kLatencyRequests, W_OK) == 0);
  bench.cycle.end();
}

TEST(CycleUnderAVirtualClock, TakesNoTimesAndAsksForNothing) {
  const ScanSettings settings = Bench::standing_still(1);
  const ScanPlan plan = make_scan_plan(settings, settings.park);
  CallLog log;
  FakeArm arm(log, settings.park);
  FakeLaser laser(log);
  VirtualClock clock;
  Executive executive(plan, settings, arm, laser);
  Cycle cycle(executive, clock, 5ms, settings.real_time);
  cycle.begin();
  for (int i = 0; i < 10; ++i) cycle.turn();
  cycle.end();
  EXPECT_EQ(cycle.cycles(), 10u);
  EXPECT_FALSE(cycle.times());
  EXPECT_FALSE(cycle.wake_ups());
  EXPECT_FALSE(cycle.granted().fifo);
  EXPECT_FALSE(cycle.granted().processors_awake);
  EXPECT_EQ(clock.now(), Stamp{} + 45ms);
}

}  // namespace
}  // namespace tankrig
