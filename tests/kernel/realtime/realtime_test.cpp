// The executive at 1 kHz with the arm on CAN, on a loaded processor, beside cyclictest. To be run in virtual time.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <atomic>
#include <fstream>

#include "drivers/arm/arm5e.hpp"
#include "rig/executive/cycle.hpp"
#include "tests/kernel/guest.hpp"
#include "tests/kernel/realtime/arm_process.hpp"
#include "tests/kernel/realtime/bus_watch.hpp"
#include "tests/kernel/realtime/load.hpp"

namespace tankrig::test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kPriority = RealTimeSettings{}.priority;  // what a rig file gets that names none
constexpr const char* kBus = "vcan0";
constexpr int kBitrate = 1'000'000;
constexpr Duration kPeriod = milliseconds(1);
constexpr Duration kSupervision = milliseconds(10);
constexpr std::uint64_t kCycles = 20'000;
constexpr std::uint64_t kFramesACycle = 3;
constexpr double kLargestError = 1e-3;          // of the elbow at rest, by the driver against the truth [rad]
constexpr Duration kLatest = microseconds(30);  // a wake-up; it tells the two kernels apart

double us(Duration d) { return 1e-3 * static_cast<double>(d.count()); }

/// A laser that does what it is told.
class ObedientLaser final : public Laser {
 public:
  Status set(bool on) noexcept override {
    on_ = on;
    return {};
  }
  Result<LaserState> state() noexcept override { return LaserState{on_, on_, on_, {}, true}; }
  Duration warm_up() const noexcept override { return Duration{0}; }

 private:
  std::atomic<bool> on_{false};
};

void show(const char* what, const Histogram& h) {
  std::printf("%-10s us: min %.2f  p50 %.2f  p90 %.2f  p99 %.2f  p99.9 %.2f  max %.2f  (%llu)\n", what, us(h.min()),
              us(h.quantile(0.5)), us(h.quantile(0.9)), us(h.quantile(0.99)), us(h.quantile(0.999)), us(h.max()),
              static_cast<unsigned long long>(h.count()));
}

/// What a sweep showed, from its first cycle to its last.
struct Sweep {
  CycleTimes times;
  std::uint64_t answered = 0, records = 0, dropped = 0;
  double largest_following_error = 0, elbow_way = 0, error_at_rest = 1;
  FrameHistogram frames_a_cycle{};
  std::uint64_t frames = 0, frames_unseen = 0;
  double timeouts = 0;  ///< of the driver, from its opening to its last stop
  double idle_seconds = 0;
  long page_faults = 0;
  Fault fault = Fault::kNone;
  std::string what;

  void take(const CycleRecord& record) {
    ++records;
    largest_following_error = std::max(largest_following_error, record.following_error);
    if (record.has_joints) {
      ++answered;
      lowest_ = std::min(lowest_, record.joints.q[kElbow]);
      highest_ = std::max(highest_, record.joints.q[kElbow]);
      elbow_way = highest_ - lowest_;
    }
    if (record.fault == Fault::kNone || fault != Fault::kNone) return;
    fault = record.fault;
    what = record.error.where;
  }

  void print() const {
    show("wake-up", times.wake_up);
    show("execution", times.execution);
    show("period", times.period);
    std::printf(
        "cycles %llu, overruns %llu, missed %llu; records %llu, with the elbow's answer %llu; timeouts %.0f; "
        "page faults %ld; processor idle %.2f s\n",
        static_cast<unsigned long long>(times.cycles), static_cast<unsigned long long>(times.overruns),
        static_cast<unsigned long long>(times.missed_cycles), static_cast<unsigned long long>(records),
        static_cast<unsigned long long>(answered), timeouts, page_faults, idle_seconds);
    std::printf("frames %llu;", static_cast<unsigned long long>(frames));
    for (std::size_t n = 0; n < frames_a_cycle.size(); ++n)
      if (const auto cycles_so = frames_a_cycle[n])
        std::printf(" %zu in each of %llu cycles;", n, static_cast<unsigned long long>(cycles_so));
    std::printf(
        " not seen %llu\nelbow's way %.3f rad, largest following error %.2f mrad, at rest %.3f mrad; "
        "fault: %s %s\n",
        static_cast<unsigned long long>(frames_unseen), elbow_way, 1e3 * largest_following_error, 1e3 * error_at_rest,
        to_string(fault), what.c_str());
  }

 private:
  double lowest_ = 1e9, highest_ = -1e9;
};

/// There and back with the elbow, from where the arm stands.
ScanPlan plan_of(ScanSettings& settings, const JointVector& stand) {
  settings.cycle_hz = 1000;
  settings.park = settings.posture = stand;
  settings.sweep.from = 1.1;
  settings.sweep.to = 1.75;
  settings.sweep.passes = 2;
  settings.real_time.overruns = 0;  // counted only: the kernel's fault is what is to be seen
  settings.control.feedback_timeout = settings.control.heartbeat_timeout = 1;
  return make_scan_plan(settings, stand);
}

Arm5eSettings arm_on_the_bus() {
  Arm5eSettings s;
  s.can.interface = kBus;
  s.can.bitrate = kBitrate;
  s.can.filters = s.can_ids.arm_filters();
  s.fast_joint = kElbow;
  s.exchange_rate_hz = 1000;
  s.silence_timeout = seconds(1);  // between its opening and the cycle's first point memory is locked
  return s;
}

JointVector stand_of(Arm& arm) {
  std::optional<JointState> stands;
  if (!becomes_true([&] {
        const auto news = arm.try_read();
        if (news.ok() && news.value()) stands = news.value();
        return stands.has_value();
      }))
    throw std::runtime_error("the arm does not answer");
  return stands->q;
}

/// Of `cycles`, all within the plan; fewer where an overrun ends it, but `at_least`.
Sweep sweep_for(std::uint64_t cycles, std::uint64_t at_least) {
  sim::ArmEmulatorParameters parameters;
  parameters.can_bitrate = kBitrate;
  ArmProcess emulator(kBus, parameters);
  ::mlockall(MCL_CURRENT | MCL_FUTURE);  // reads from the host what is not here yet, before anything keeps time
  MonotonicClock clock;
  const Arm5eSettings arm_settings = arm_on_the_bus();
  const auto arm = open_arm5e(arm_settings, arm5e(), clock);
  arm->set_zero({emulator.true_zero(), "by truth"});
  const JointVector stand = stand_of(*arm);
  const Load load;  // not before: opening an arm is not real time, and one that was silent is asked for everything

  ScanSettings settings;
  const ScanPlan plan = plan_of(settings, stand);
  std::printf("plan: %.1f s\n", plan.duration());
  if (plan.duration() < 1e-3 * static_cast<double>(cycles)) throw std::runtime_error("the sweep is too short");
  ObedientLaser laser;
  Executive executive(plan, settings, *arm, laser, 4096);
  BusWatch watch(kBus, kBitrate, arm_settings.can_ids, cycles + 1000, clock);
  executive.set_listener(&watch);
  Sweep sweep;
  Cycle cycle(executive, clock, kPeriod, settings.real_time);
  executive.set_interlock(true);
  executive.heartbeat(clock.now());
  const std::uint64_t frames_before = frames_once_silent(kBus);
  const double idle_before = processor_idle();
  cycle.begin();
  cycle.turn();
  executive.start(clock.now() + milliseconds(100));
  executive.set_armed(true);
  CycleRecord record;
  const auto supervise = [&] {
    executive.heartbeat(clock.now());
    while (executive.try_pop(record)) sweep.take(record);
    clock.sleep_until(clock.now() + kSupervision);
  };
  rusage before{}, after{};
  ::getrusage(RUSAGE_SELF, &before);
  while (cycle.cycles() < at_least || (cycle.cycles() < cycles && cycle.overruns() == 0)) supervise();
  ::getrusage(RUSAGE_SELF, &after);
  cycle.end();
  supervise();
  sweep.idle_seconds = processor_idle() - idle_before;
  sweep.frames = frames_once_silent(kBus) - frames_before;
  watch.finish();
  sweep.frames_a_cycle = watch.frames_a_cycle();
  sweep.frames_unseen = watch.lost();
  (void)arm->stop();
  becomes_true([&] {
    const auto news = arm->try_read();
    if (news.ok() && news.value()) sweep.error_at_rest = std::abs(news.value()->q[kElbow] - emulator.truth()[kElbow]);
    return sweep.error_at_rest < kLargestError;
  });
  sweep.times = *cycle.times();
  sweep.dropped = executive.records_dropped();
  sweep.page_faults = after.ru_minflt - before.ru_minflt + after.ru_majflt - before.ru_majflt;
  for (const Statistic& s : arm->statistics())
    if (s.name == "timeouts") sweep.timeouts = s.value;

  EXPECT_TRUE(cycle.granted().fifo);
  EXPECT_TRUE(cycle.granted().memory_locked);
  sweep.print();
  return sweep;
}

bool kernel_is_preempt_rt() { return std::ifstream("/sys/kernel/realtime").good(); }

TEST(RealTimeOnPreemptRt, KeepsOneKilohertzUnderLoadAsCyclictestDoes) {
  ASSERT_TRUE(kernel_is_preempt_rt());
  const Sweep sweep = sweep_for(kCycles, kCycles);
  const Duration peer = loaded_cyclictest(kPriority, kCycles);
  EXPECT_GE(sweep.times.cycles, kCycles);
  EXPECT_EQ(sweep.times.overruns, 0U);
  EXPECT_LE(2 * sweep.times.wake_up.max(), 3 * peer);
  EXPECT_LE(sweep.times.wake_up.max(), kLatest) << "the bound that tells this kernel from the standard one";
  EXPECT_EQ(sweep.fault, Fault::kNone) << sweep.what;
  EXPECT_EQ(sweep.dropped, 0U);
  EXPECT_EQ(sweep.records, sweep.times.cycles);
  EXPECT_GE(sweep.answered + 1, sweep.records) << "but for the first, every cycle has the answer to the one before";
  EXPECT_EQ(sweep.frames_unseen, 0U);
  EXPECT_EQ(sweep.frames_a_cycle[kFramesACycle], sweep.times.cycles) << "each of them";
  EXPECT_EQ(sweep.frames, kFramesACycle * sweep.times.cycles) << "by the kernel's count";
  EXPECT_EQ(sweep.timeouts, 0);
  EXPECT_GT(sweep.elbow_way, 0.55);
  EXPECT_LT(sweep.error_at_rest, kLargestError);
  EXPECT_EQ(sweep.page_faults, 0);
  EXPECT_LT(sweep.idle_seconds, 1) << "of twenty: the load is no load";
}

// The same program under the same load: what the test above asserts is the kernel's doing.
TEST(RealTimeOnTheStandardKernel, MissesCycles) {
  ASSERT_FALSE(kernel_is_preempt_rt());
  const Sweep sweep = sweep_for(kCycles, 4000);
  EXPECT_GT(sweep.times.overruns, 0U);
  EXPECT_GT(sweep.times.wake_up.max(), kPeriod / 2) << "far beyond the 30 us of the other kernel";
  EXPECT_GT(sweep.times.wake_up.quantile(0.99), kLatest) << "not once, but again and again";
}

}  // namespace
}  // namespace tankrig::test
