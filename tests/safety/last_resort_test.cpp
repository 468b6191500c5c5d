// What a dying program leaves on the wires of its laser and its arm, whichever thread dies and wherever it is.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/arm/arm5e.hpp"
#include "drivers/arm/serial_arm_link.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "rig/safety/emergency.hpp"
#include "rig/safety/guarded_outputs.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/named_thread.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

enum class Wire { kCan, kSerial };

struct Paths {
  std::filesystem::path laser, arm, bus;
};

/// How long either waits for a cycle that hangs.
struct Patience {
  Duration laser, arm;
};

Arm5eSettings arm_settings(Wire wire, const Paths& paths, Duration watchdog) {
  Arm5eSettings s;
  s.watchdog = watchdog;
  s.silence_timeout = 60s;
  s.carrier = wire == Wire::kCan ? ArmCarrier::kCan : ArmCarrier::kSerial;
  s.can.interface = "unix:" + paths.bus.string();
  s.serial.device = paths.arm;
  s.exchange_rate_hz = 50;
  return s;
}

std::atomic<int> doom{0};  ///< the signal that ends the thread inside the driver

/// Another link, until its end is near: then a part of a request is put on the wire, and the thread inside dies or
/// hangs.
class DoomedLink final : public ArmLink {
 public:
  DoomedLink(std::unique_ptr<ArmLink> link, std::function<void()> send_a_part)
      : link_(std::move(link)), send_a_part_(std::move(send_a_part)) {}

  Status try_send(const ArmDemands& demands, const ArmExchange& exchange, Stamp now) noexcept override {
    if (const int signal = doom) {
      send_a_part_();
      std::raise(signal);
    }
    return link_->try_send(demands, exchange, now);
  }
  Status try_send(const PidSlot& gains, Stamp now) noexcept override { return link_->try_send(gains, now); }
  void send_regardless(const ArmDemands& demands) const noexcept override { link_->send_regardless(demands); }
  Result<std::optional<ArmAnswer>> try_receive(Stamp now) noexcept override { return link_->try_receive(now); }
  int outstanding() const noexcept override { return link_->outstanding(); }
  void forget() noexcept override { link_->forget(); }
  Status reopen() noexcept override { return link_->reopen(); }
  bool needs_reopen() const noexcept override { return link_->needs_reopen(); }
  Duration exchange_time() const noexcept override { return link_->exchange_time(); }
  ArmLinkCounters counters() const noexcept override { return link_->counters(); }

 private:
  std::unique_ptr<ArmLink> link_;
  std::function<void()> send_a_part_;
};

constexpr std::array<int, kJoints> kDrive{0, 0, 300, 0, 0};
constexpr int kHang = SIGUSR1;  ///< the thread that gets it hangs
constexpr int kCrashInside = SIGUSR2, kHangInside = SIGHUP;
constexpr Patience kEndless{120s, 120s};

SerialFrame driving_frame() {
  SerialContent content;
  content.slots[kElbow].bytes = encode(DemandSlot{DemandType::kSpeedForward, 300, 0, 0});
  return encode(content);
}

/// A lit sweep in a process of its own. By kCrashInside and kHangInside its cycle ends inside the arm's driver.
[[noreturn]] void sweep(Wire wire, const Paths& paths, const Patience& patience) {
  ::alarm(60);
  std::signal(kHang, [](int) {
    while (true) ::pause();
  });
  std::signal(kCrashInside, [](int) { doom = SIGSEGV; });
  std::signal(kHangInside, [](int) { doom = kHang; });
  MonotonicClock clock;
  const Arm5eSettings settings = arm_settings(wire, paths, patience.arm);
  RelayLaser laser({.serial = {.device = paths.laser.string(), .baud = 9600},
                    .warm_up = 20ms,
                    .refresh = 20ms,
                    .answer_timeout = 500ms,
                    .caller_timeout = patience.laser,
                    .opening_timeout = 20s});
  std::unique_ptr<ArmLink> link;
  std::function<void()> send_a_part;
  if (wire == Wire::kCan) {
    link = std::make_unique<CanArmLink>(open_can(settings.can, clock), settings.can_ids, settings.can.bitrate);
    std::shared_ptr<CanBus> again = open_can(settings.can, clock);
    send_a_part = [again, ids = settings.can_ids] {
      const SlotBytes drive = encode(DemandSlot{DemandType::kSpeedForward, 300, 0, 0});
      for (const Joint joint : {kSlew, kShoulder, kElbow}) again->send_regardless({ids.demand[joint], 8, drive, {}});
    };
  } else {
    SerialPort port(settings.serial);
    const int line = port.descriptor();
    link = std::make_unique<SerialArmLink>(std::move(port));
    send_a_part = [line] { [[maybe_unused]] const ssize_t n = ::write(line, driving_frame().data(), 20); };
  }
  auto doomed = std::make_unique<DoomedLink>(std::move(link), send_a_part);
  Arm5e arm(settings, arm5e(), std::move(doomed), clock);
  const EmergencyStop emergency(laser, arm);
  GuardedOutputs outputs(arm, laser, SafetySettings{});
  InterlockInputs in{.interlock_closed = true, .heartbeat_fresh = true, .sweeping = true};
  std::thread([&] {
    for (int turn = 0;; ++turn) {
      in.now = Stamp{} + turn * 1s;  // the lamp before the light is not what is looked at here
      (void)outputs.step(in);
      in.arm = in.laser_request = true;
      if (turn < 10) (void)outputs.switch_laser();
      (void)outputs.read_laser();
      (void)arm.try_read();
      (void)drive_ticks(arm, kDrive);
      clock.sleep_until(clock.now() + 5ms);
    }
  }).join();
  std::abort();
}

/// What the arm hears: its joints' newest demands.
class Ear {
 public:
  Ear(Wire wire, const Paths& paths) {
    if (wire == Wire::kSerial) {
      line_.emplace(paths.arm);
      return;
    }
    hub_.emplace(sim::CanHubSettings{.path = paths.bus});
    CanSettings settings;
    settings.interface = "unix:" + paths.bus.string();
    node_ = open_can(settings, clock_);
  }
  void listen() {
    if (line_) {
      std::array<std::uint8_t, 64> bytes;
      for (std::size_t n = 0; (n = line_->try_read(bytes).value()) > 0;)
        for (std::size_t i = 0; i < n; ++i)
          if (decoder_.push(bytes[i]) && decoder_.content().slots[0].kind == 0)
            for (std::size_t j = 0; j < kJoints; ++j) hear(j, decode_demand(decoder_.content().slots[j].bytes));
      return;
    }
    const ArmCanIds ids;
    for (auto got = node_->try_receive(); got.ok() && got.value(); got = node_->try_receive())
      for (std::size_t j = 0; j < kJoints; ++j)
        if (got.value()->id == ids.demand[j]) hear(j, decode_demand(got.value()->data));
  }
  bool driven() const { return driven_; }
  /// Since when, as far as it was listened to.
  Stamp rested() const { return rested_; }
  bool at_rest() const {
    return std::all_of(newest_.begin(), newest_.end(), [](DemandType t) { return t == DemandType::kStop; });
  }

 private:
  void hear(std::size_t joint, const DemandSlot& demand) {
    const bool rested = at_rest();
    newest_[joint] = demand.type;
    if (at_rest() && !rested) rested_ = clock_.now();
    driven_ = driven_ || demand.type != DemandType::kStop;
  }

  MonotonicClock clock_;
  std::optional<sim::Pty> line_;
  SerialDecoder decoder_;
  std::optional<sim::CanHub> hub_;
  std::unique_ptr<CanBus> node_;
  std::array<DemandType, kJoints> newest_{};
  bool driven_ = false;
  Stamp rested_{};
};

/// A lit sweep in another process, and the other ends of its wires.
class LastResort : public testing::TestWithParam<Wire> {
 protected:
  void SetUp() override { ASSERT_EQ(::pipe(go_), 0); }
  void TearDown() override {
    if (child_ > 0 && ::kill(child_, SIGKILL) == 0) ::waitpid(child_, nullptr, 0);
    for (const int end : go_) ::close(end);
  }

  void begin(const Patience& patience) {
    child_ = ::fork();  // before this process has threads
    if (child_ == 0) {
      char byte = 0;
      if (::read(go_[0], &byte, 1) != 1) ::_exit(1);
      sweep(GetParam(), paths_, patience);
    }
    box_.emplace(sim::RelayEmulatorSettings{.name = paths_.laser, .watchdog = 0s}, lamp_);
    ear_.emplace(GetParam(), paths_);
    ASSERT_EQ(::write(go_[1], "!", 1), 1);
    ASSERT_TRUE(until([&] { return box_->relay_closed() && ear_->driven() && !ear_->at_rest(); }));
  }

  template <class Condition>
  bool until(Condition condition) {
    for (const Stamp end = clock_.now() + 30s; clock_.now() < end; std::this_thread::sleep_for(1ms)) {
      ear_->listen();
      if (condition()) return true;
    }
    return false;
  }

  void is_dark_and_at_rest() {
    EXPECT_TRUE(until([&] { return !box_->relay_closed() && ear_->at_rest(); }))
        << (box_->relay_closed() ? "lit, " : "dark, ") << (ear_->at_rest() ? "at rest" : "driven");
    const std::vector<std::uint8_t> bytes = box_->take_received();
    ASSERT_FALSE(bytes.empty());
    EXPECT_EQ(bytes.back(), RelayProtocol{}.off_byte);
  }

  void died_safely() {
    int status = 0;
    ASSERT_TRUE(until([&] { return ::waitpid(child_, &status, WNOHANG) == child_; }));
    child_ = -1;
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV) << status;
    is_dark_and_at_rest();
  }

  void crashes(const std::string& thread) {
    begin(kEndless);
    ASSERT_TRUE(testing_support::signal_thread(child_, thread, SIGSEGV)) << thread;
    died_safely();
  }

  pid_t child_ = -1;
  TemporaryFolder folder_;
  const Paths paths_{folder_.path() / "laser", folder_.path() / "arm", folder_.path() / "bus"};
  MonotonicClock clock_;
  sim::MockLaser lamp_{20ms, clock_};
  std::optional<sim::RelayEmulator> box_;
  std::optional<Ear> ear_;

 private:
  int go_[2]{-1, -1};
};

TEST_P(LastResort, ReachesTheWiresWhenTheRelaysThreadCrashes) { crashes("laser-relay"); }
TEST_P(LastResort, ReachesTheWiresWhenTheArmsKeeperCrashes) { crashes("arm-keeper"); }
TEST_P(LastResort, ReachesTheWiresWhenTheCycleCrashesInsideTheDriverWithHalfARequestSent) {
  begin(kEndless);
  ASSERT_EQ(::kill(child_, kCrashInside), 0);
  died_safely();
}

TEST_P(LastResort, IsNotNeededWhereTheCycleHangsInsideTheDriverTheDevicesOwnThreadsEndIt) {
  constexpr Patience kPatience{500ms, 2500ms};
  begin(kPatience);
  testing_support::MachineWitness witness;
  const Stamp hung = clock_.now();
  ASSERT_EQ(::kill(child_, kHangInside), 0);
  is_dark_and_at_rest();
  const Stamp dark = box_->opened().value(), rested = ear_->rested();
  EXPECT_GE(rested - hung, kPatience.arm / 2) << "stopped by something else";
  TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  EXPECT_LT(dark - hung, kPatience.arm) << "by the laser's own time-out";
  EXPECT_LT(dark, rested) << "the laser goes off first";
}

INSTANTIATE_TEST_SUITE_P(Wires, LastResort, testing::Values(Wire::kCan, Wire::kSerial),
                         [](const auto& wire) { return wire.param == Wire::kCan ? "Can" : "Serial"; });

}  // namespace
}  // namespace tankrig
