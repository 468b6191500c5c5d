// Nothing is allocated, locked, waited for, thrown or paged in within the cycle; and each of these would be seen.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdio>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "drivers/laser/relay_laser.hpp"
#include "rig/capture/triggers.hpp"
#include "rig/executive/cycle.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/real_time/cycle_watch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/recording_sink.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using sim::testing_support::ArmBench;
using sim::testing_support::Wire;
using testing_support::CallLog;
using testing_support::CycleWatch;
using testing_support::FakeArm;
using testing_support::FakeLaser;
using testing_support::Misdeeds;

/// The arm at the cycle's end of the wire; from one of its cycles to another the thread that reads it is watched.
class WatchedArm final : public Arm {
 public:
  WatchedArm(Arm& arm, int from, std::atomic<bool>& enough) : arm_(arm), from_(from), enough_(enough) {}

  Result<std::optional<JointState>> try_read() noexcept override {
    if (cycle_ == from_) CycleWatch::begin();
    if (cycle_ >= from_ && !done_ && enough_.load()) {
      deeds_ = CycleWatch::end();
      watched_ = cycle_ - from_;
      done_ = true;
    }
    ++cycle_;
    return arm_.try_read();
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override { return arm_.stop(); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

  bool done() const noexcept { return done_.load(); }
  const Misdeeds& deeds() const { return deeds_; }
  int watched() const { return watched_; }

 private:
  Arm& arm_;
  const int from_;
  std::atomic<bool>& enough_;
  int cycle_ = 0, watched_ = 0;
  std::atomic<bool> done_{false};
  Misdeeds deeds_;
};

ScanSettings short_scan(const JointVector& park) {
  ScanSettings s;
  s.park = s.posture = park;
  s.sweep.from = park[kElbow] + 0.1;
  s.sweep.to = park[kElbow] + 0.2;
  s.move.velocity = s.sweep.velocity = 0.2;
  s.capture.dark_frames = 2;
  s.move.settle = 0.1;
  s.capture.laser_warm_up = 0.1;
  s.control.feedback_timeout = s.control.heartbeat_timeout = 5;
  s.control.following_error_limit = 1;  // where the disk is busy, the kernel hands over what a line brought much later
  s.limits.velocity = s.limits.ticks_per_s = 1e6;
  s.safety.laser_off_allowance = s.safety.laser_on_margin = 5;
  s.real_time.overruns = 0;
  return s;
}

/// A cycle in real time around an arm and a laser, from rest to the plan's end.
struct WatchedCycle {
  MonotonicClock clock;
  ScanSettings settings;
  ScanPlan plan;
  std::atomic<bool> enough{false};
  WatchedArm arm;
  Executive executive;
  Cycle cycle;
  CycleRecord last;
  bool lit = false;

  WatchedCycle(const ScanSettings& s, Arm& real_arm, Laser& laser)
      : settings(s),
        plan(make_scan_plan(s, s.park)),
        arm(real_arm, 20, enough),
        executive(plan, s, arm, laser),
        cycle(executive, clock, 2ms, s.real_time, {.noticed = 1h, .given_up = 1h}) {}  // the machine may stand still

  void turn() {
    executive.heartbeat(clock.now());
    cycle.turn();
    CycleRecord record;
    while (executive.try_pop(record)) {
      last = record;
      lit = lit || (record.laser && record.laser->emitting);
    }
  }
  bool until(const std::function<bool()>& end, Duration deadline = 30s) {
    const Stamp give_up = clock.now() + deadline;
    while (!end() && clock.now() < give_up) turn();
    return end();
  }
  std::string reason() const {
    return std::string(to_string(last.fault)) + " " + last.error.where +
           (last.violation ? ": " + describe(*last.violation) : "");
  }
  void go() {
    executive.set_interlock(true);
    cycle.begin();
    turn();
    executive.set_armed(true);
    executive.start(clock.now() + 50ms);
  }
  /// What the cycle's thread did in its watched cycles.
  Misdeeds finish() {
    enough = true;
    EXPECT_TRUE(until([&] { return arm.done(); }));
    cycle.end();
    return arm.deeds();
  }
  void expect_pure() {
    const Misdeeds deeds = finish();
    SCOPED_TRACE(testing_support::to_string(deeds));
    EXPECT_GT(arm.watched(), 100);
    EXPECT_EQ(deeds.sleeps, static_cast<std::uint64_t>(arm.watched())) << "one sleep a cycle, and nothing else waits";
    EXPECT_EQ(deeds.allocations, 0u);
    EXPECT_EQ(deeds.locks, 0u);
    EXPECT_EQ(deeds.exceptions, 0u);
    EXPECT_EQ(deeds.calls, 0u);
    if (cycle.granted().memory_locked) {
      EXPECT_EQ(deeds.page_faults, 0u);
    } else {
      std::printf("%llu page faults are not judged: this machine locks no memory\n",
                  static_cast<unsigned long long>(deeds.page_faults));
    }
  }
};

/// The real drivers, each on the wire of its emulated device.
struct Devices {
  ArmBench arm;
  TemporaryFolder folder;
  MonotonicClock clock;
  sim::MockLaser lamp{100ms, clock};
  sim::RelayEmulator relay{{.name = folder.path() / "laser"}, lamp};
  std::unique_ptr<RelayLaser> laser;

  explicit Devices(Wire wire) : arm(wire) {
    arm.make();
    arm.state();
    laser = std::make_unique<RelayLaser>(
        RelayLaserSettings{.serial = {.device = (folder.path() / "laser").string(), .baud = 9600},
                           .warm_up = 100ms,
                           .answer_timeout = 2s,
                           .opening_timeout = 10s});
  }
};

class PureCycle : public ::testing::TestWithParam<Wire> {
 protected:
  void SetUp() override {
    if (const std::string why = testing_support::why_no_watch(); !why.empty()) GTEST_SKIP() << why;
  }
};
INSTANTIATE_TEST_SUITE_P(Both, PureCycle, ::testing::Values(Wire::kPair, Wire::kPty),
                         [](const auto& wire) { return wire.param == Wire::kPair ? "CanPair" : "Serial"; });

TEST_P(PureCycle, OfAWholeScanWithTheRealDriversIsPure) {
  Devices devices(GetParam());
  WatchedCycle sut(short_scan(devices.arm.parameters.power_up), *devices.arm.arm, *devices.laser);
  sut.go();
  ASSERT_TRUE(sut.until(
      [&] { return sut.last.state != ExecutiveState::kWaiting && sut.last.state != ExecutiveState::kRunning; }));
  EXPECT_EQ(sut.last.state, ExecutiveState::kDone) << sut.reason();
  EXPECT_TRUE(sut.lit);
  for (int i = 0; i < 20; ++i) sut.turn();
  sut.expect_pure();
}

/// Hears its triggers, and gives no frames.
class HeardCamera final : public Camera {
 public:
  explicit HeardCamera(std::string name) : name_(std::move(name)) {}
  CameraInfo info() const override { return {name_, 2, 2, 1, 25}; }
  Status start() override { return {}; }
  Result<std::optional<Frame>> try_grab() override { return std::optional<Frame>{}; }
  void stop() noexcept override {}
  CameraCounters counters() const override { return {}; }
  Status trigger() override { return ++heard, Status{}; }

  std::atomic<int> heard{0};

 private:
  const std::string name_;
};

/// Whole periods of the plan's time in its recorded parts.
int due_by_time(const ScanPlan& plan, double period) {
  int due = 0;
  for (int n = 0; n * period < plan.duration(); ++n) {
    const Segment& s = plan.segments()[plan.segment_at(n * period)];
    due += s.phase != Phase::kMove && n * period >= s.record_begin && n * period <= s.record_end;
  }
  return due;
}

TEST_P(PureCycle, StaysPureWhileItTriggersCamerasByTimeAndByPosition) {
  testing_support::MachineWitness witness;
  Devices devices(GetParam());
  ScanSettings settings = short_scan(devices.arm.parameters.power_up);
  settings.cycle_hz = 500;
  WatchedCycle sut(settings, *devices.arm.arm, *devices.laser);
  testing_support::RecordingSink sink;
  HeardCamera by_time("left"), by_angle("mono");
  Triggers triggers(sut.plan, sut.settings, sut.clock, sink);
  triggers.add_camera(0, by_time, RecordWhen::kAll, {TriggerMode::kSoftware, 0, 5ms});
  triggers.add_camera(1, by_angle, RecordWhen::kSweep, {TriggerMode::kPosition, 5e-3, 5ms});
  sut.executive.set_listener(&triggers);
  triggers.begin();
  sut.go();
  EXPECT_TRUE(sut.until([&] {
    EXPECT_EQ(triggers.collect(), "");
    return sut.last.state != ExecutiveState::kWaiting && sut.last.state != ExecutiveState::kRunning;
  }));
  EXPECT_EQ(sut.last.state, ExecutiveState::kDone) << sut.reason();
  sut.expect_pure();
  auto counts = triggers.counts();
  const auto accounted = [&](const HeardCamera& camera) {
    const std::string name = camera.info().name;
    return camera.heard + static_cast<int>(counts[name + ".trigger_skipped"] + counts[name + ".trigger_dropped"]);
  };
  EXPECT_GT(by_time.heard, 0);
  EXPECT_GT(by_angle.heard, 0);
  EXPECT_EQ(accounted(by_angle), 21) << "0.1 rad, every 5 mrad, both ends";
  TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  EXPECT_EQ(accounted(by_time), due_by_time(sut.plan, 1 / by_time.info().rate_hz));
}

TEST_P(PureCycle, StaysPureWhenItMakesSafeAfterAFault) {
  Devices devices(GetParam());
  WatchedCycle sut(short_scan(devices.arm.parameters.power_up), *devices.arm.arm, *devices.laser);
  sut.go();
  ASSERT_TRUE(sut.until([&] { return sut.lit; }));
  devices.arm.emulator->set_faults({.silent = true});
  ASSERT_TRUE(sut.until([&] { return sut.last.state == ExecutiveState::kFault; }));
  EXPECT_EQ(sut.last.fault, Fault::kArmRead);
  for (int i = 0; i < 20; ++i) sut.turn();
  sut.expect_pure();
}

TEST_P(PureCycle, StaysPureWhenTheLasersLineIsPulled) {
  Devices devices(GetParam());
  WatchedCycle sut(short_scan(devices.arm.parameters.power_up), *devices.arm.arm, *devices.laser);
  sut.go();
  ASSERT_TRUE(sut.until([&] { return sut.lit; }));
  devices.relay.unplug();
  ASSERT_TRUE(sut.until([&] { return sut.last.state == ExecutiveState::kFault; }));
  EXPECT_EQ(sut.last.fault, Fault::kLaser);
  for (int i = 0; i < 20; ++i) sut.turn();
  sut.expect_pure();
}

/// The arm on a line, or on a bus, that goes away and comes back.
struct PulledArm {
  ArmBench bench;
  std::unique_ptr<sim::CanHub> hub;
  sim::CanHubSettings bus{.path = bench.folder.path() / "bus"};

  explicit PulledArm(Wire wire) : bench(wire) {
    if (!on_bus()) {
      bench.make();
    } else {
      CanSettings device;
      device.interface = bench.settings.can.interface = "unix:" + bus.path.string();
      hub = std::make_unique<sim::CanHub>(bus);
      bench.parameters.can_paced = false;  // the hub is
      bench.emulator = std::make_unique<sim::ArmEmulator>(bench.model, bench.parameters, bench.clock);
      bench.emulator->serve(open_can(device, bench.clock));
      bench.arm = open_arm5e(bench.settings, bench.model, bench.clock);
      bench.arm->set_zero({bench.emulator->true_zero(), "by truth"});
    }
    bench.state();
  }
  void pull() {
    bench.emulator->unplug();
    hub.reset();
  }
  void plug() {
    if (on_bus()) hub = std::make_unique<sim::CanHub>(bus);
    bench.emulator->plug();
  }
  bool on_bus() const { return bench.settings.carrier == ArmCarrier::kCan; }
};

TEST_P(PureCycle, StaysPureWhenTheArmIsUnpluggedAndWhenItComesBack) {
  PulledArm arm(GetParam());
  CallLog log;
  FakeLaser laser(log);
  WatchedCycle sut(short_scan(arm.bench.parameters.power_up), *arm.bench.arm, laser);
  sut.go();
  ASSERT_TRUE(sut.until([&] { return sut.last.state == ExecutiveState::kRunning; }));
  arm.pull();
  ASSERT_TRUE(sut.until([&] { return sut.last.state == ExecutiveState::kFault; }));
  EXPECT_STREQ(sut.last.error.where, "arm: carrier lost") << to_string(sut.last.fault);
  const Stamp looked_for = sut.clock.now() + 300ms;  // by then it was, more than once
  EXPECT_TRUE(sut.until([&] { return sut.clock.now() > looked_for; }));
  arm.plug();
  EXPECT_TRUE(sut.until([&] { return sut.last.has_joints; })) << "it is heard again";
  EXPECT_EQ(arm.bench.statistic("reopened"), 1);
  sut.expect_pure();
}

// ---------------------------------------------------------------------- what the watch sees, one misdeed at a time

/// Does as it should, and once something else.
class BadArm final : public Arm {
 public:
  explicit BadArm(std::function<void()> misdeed) : misdeed_(std::move(misdeed)) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    if (++cycles_ > 50 && allowed_ && !done_) {
      if (misdeed_) misdeed_();
      done_ = true;
    }
    return arm_.try_read();
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override { return arm_.stop(); }
  Duration exchange_period() const noexcept override { return 2ms; }
  void allow() { allowed_ = true; }
  bool done() const { return done_; }

 private:
  CallLog log_;
  FakeArm arm_{log_, JointVector::Zero()};
  std::function<void()> misdeed_;
  int cycles_ = 0;
  std::atomic<bool> allowed_{false}, done_{false};
};

class CycleWatchSees : public PureCycle {
 protected:
  /// What is seen of a misdeed; `prepare` comes before it, when the memory has been locked.
  static Misdeeds of(std::function<void()> misdeed, const std::function<void()>& prepare = {}) {
    CallLog log;
    FakeLaser laser(log);
    BadArm arm(std::move(misdeed));
    ScanSettings s;
    s.control.feedback_timeout = 1e9;  // the fake arm's clock stands still
    s.park = (JointVector() << 0, 0.12, 1.2, 0, 0.1).finished();
    s.posture = s.park;
    WatchedCycle sut(s, arm, laser);
    sut.cycle.begin();
    if (prepare) prepare();
    arm.allow();
    EXPECT_TRUE(sut.until([&] { return arm.done(); }));
    return sut.finish();
  }
};
INSTANTIATE_TEST_SUITE_P(Fakes, CycleWatchSees, ::testing::Values(Wire::kPair), [](const auto&) { return "Arm"; });

TEST_P(CycleWatchSees, NothingInAGoodStep) {
  const Misdeeds deeds = of({});
  EXPECT_EQ(deeds.allocations + deeds.locks + deeds.exceptions + deeds.calls + deeds.messages, 0u)
      << testing_support::to_string(deeds);
}

TEST_P(CycleWatchSees, AnAllocation) {
  const Misdeeds deeds = of([] { delete new volatile int(1); });
  EXPECT_EQ(deeds.allocations, 2u) << "taken and given back";
  EXPECT_EQ(deeds.locks + deeds.exceptions, 0u);
  if (deeds.calls > 0) {  // a thread's first may ask the system for an arena of its own
    EXPECT_THAT(deeds.first_call, ::testing::AnyOf(SYS_mmap, SYS_munmap, SYS_mprotect));
  }
  void* volatile block = nullptr;
  const Misdeeds of_c = of([&] {
    block = ::calloc(3, 5);
    ::free(block);
  });
  EXPECT_EQ(of_c.allocations, 2u);
}

TEST_P(CycleWatchSees, ALockThatNobodyElseHolds) {
  std::mutex mutex;
  const Misdeeds deeds = of([&] { const std::lock_guard lock(mutex); });
  EXPECT_EQ(deeds.locks, 1u);
  EXPECT_EQ(deeds.calls + deeds.allocations + deeds.exceptions, 0u);
}

TEST_P(CycleWatchSees, AWaitForAnotherThread) {
  std::mutex mutex;
  std::condition_variable never;
  const Misdeeds deeds = of([&] {
    std::unique_lock lock(mutex);
    never.wait_for(lock, 1ms);
  });
  EXPECT_GE(deeds.locks, 1u);
  EXPECT_GE(deeds.calls, 1u);
}

TEST_P(CycleWatchSees, AnException) {
  const Misdeeds deeds = of([] {
    try {
      throw std::runtime_error("caught at once");
    } catch (const std::exception&) {
    }
  });
  EXPECT_EQ(deeds.exceptions, 1u);
}

TEST_P(CycleWatchSees, APageThatWasNotThere) {
  constexpr std::size_t kPages = 4, kSize = kPages * 4096;
  volatile char* fresh = nullptr;
  const auto map = [&] {
    fresh = static_cast<volatile char*>(
        ::mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
  };
  const Misdeeds deeds = of(
      [&] {
        for (std::size_t page = 0; page < kPages; ++page) fresh[page * 4096] = 1;
      },
      map);
  ::munmap(const_cast<char*>(fresh), kSize);
  EXPECT_GE(deeds.page_faults, 1u);
  EXPECT_EQ(deeds.calls + deeds.allocations + deeds.locks, 0u);
}

TEST_P(CycleWatchSees, ASleepThatIsNotTheCyclesOwn) {
  const Misdeeds deeds = of([] { std::this_thread::sleep_for(1ms); });
  EXPECT_EQ(deeds.calls, 1u);
}

TEST_P(CycleWatchSees, ReadingFromWhatMayLetItWait) {
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  ASSERT_EQ(::write(pipe[1], "x", 1), 1);
  char byte = 0;
  const Misdeeds deeds = of([&] { (void)!::read(pipe[0], &byte, 1); });
  EXPECT_EQ(deeds.calls, 1u);
  EXPECT_EQ(byte, 'x') << "the call was made all the same";
  ::close(pipe[0]);
  ::close(pipe[1]);
}

TEST_P(CycleWatchSees, Printing) {
  EXPECT_GE(of([] { (void)!::write(STDERR_FILENO, "", 0); }).calls, 1u);
}

}  // namespace
}  // namespace tankrig
