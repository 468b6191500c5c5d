// The cycle's own thread, paced by an arm that samples by a clock of its own, in time that only this thread moves.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "rig/executive/cycle.hpp"
#include "tests/support/fakes.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::CallLog;
using testing_support::FakeLaser;

constexpr Duration kPeriod = 5ms, kWire = 700us;
constexpr std::uint64_t kCycles = 40'000;
constexpr std::uint64_t kSettled = 6000;  // by then a grid has met the edge between two samples, at the least drift too

/// Real to the cycle, which has a thread for it, and wakes up to 100 us late; who else sleeps yields.
class CyclesClock final : public Clock {
 public:
  Stamp now() const noexcept override { return virtual_.now(); }
  void sleep_until(Stamp when) noexcept override {
    if (std::this_thread::get_id() == maker_) return std::this_thread::yield();
    virtual_.sleep_until(when + Duration{(++sleeps_ * 7919) % 100'000});
  }
  bool real_time() const noexcept override { return true; }

 private:
  const std::thread::id maker_ = std::this_thread::get_id();
  VirtualClock virtual_;
  std::int64_t sleeps_ = 0;
};

/// Its samples come `kWire` after it took them, whether they are asked for or not.
class SamplingArm final : public Arm {
 public:
  SamplingArm(const Clock& clock, Duration period, const JointVector& q) : clock_(clock), period_(period), q_(q) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    const std::int64_t newest = (clock_.now().ns - kWire.count()) / period_.count();
    if (++reads_ > kSettled && reads_ < kCycles) out_of_step += newest != told_ + 1;
    if (newest == told_) return std::optional<JointState>{};
    told_ = newest;
    JointState s;
    s.stamp = Stamp{newest * period_.count()};
    s.q = q_;
    return std::optional<JointState>(s);
  }
  Result<JointVector> write_velocity(const OutputRight&, const JointVector& v) noexcept override { return v; }
  Status stop() noexcept override { return {}; }
  Duration exchange_period() const noexcept override { return period_; }

  std::atomic<int> out_of_step{0};  ///< cycles that met no sample, or more than one

 private:
  const Clock& clock_;
  const Duration period_;
  const JointVector q_;
  std::uint64_t reads_ = 0;
  std::int64_t told_ = 0;
};

int out_of_step(CyclePace pace, double drift) {
  ScanSettings s;
  s.park << 0, 0.12, 1.2, 0, 0.1;
  s.posture = s.park;
  s.real_time.overruns = 0;
  s.real_time.lock_memory = false;
  s.real_time.pace = pace;
  const ScanPlan plan = make_scan_plan(s, s.park);
  CallLog log;
  CyclesClock clock;
  SamplingArm arm(clock, from_seconds(seconds(kPeriod) * (1 + drift)), s.park);
  FakeLaser laser(log);
  Executive executive(plan, s, arm, laser);
  Cycle cycle(executive, clock, kPeriod, s.real_time, {.noticed = 24h, .given_up = 24h});
  cycle.begin();
  while (cycle.cycles() < kCycles) std::this_thread::yield();
  EXPECT_TRUE(cycle.end());
  return arm.out_of_step;
}

TEST(CyclePacedByItsDevice, MeetsOneSampleInEveryCycleWhereAFixedGridDoesNot) {
  for (const double drift : {-2e-3, -2e-4, 2e-4, 2e-3}) {
    SCOPED_TRACE(drift);
    EXPECT_EQ(out_of_step(CyclePace::kDevice, drift), 0);
    EXPECT_GT(out_of_step(CyclePace::kClock, drift), 5);
  }
}

}  // namespace
}  // namespace tankrig
