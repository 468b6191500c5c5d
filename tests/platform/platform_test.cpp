// Verdicts on machines made of files.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "core/input_error.hpp"
#include "rig/platform/devices.hpp"
#include "rig/platform/machine.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// A root folder with /proc, /sys and /dev of its own.
struct Machine {
  TemporaryFolder folder;
  const fs::path& root = folder.path();

  const Machine& with(const std::string& file, const std::string& text) const {
    fs::create_directories((root / file).parent_path());
    std::ofstream(root / file) << text << "\n";
    return *this;
  }
};

TEST(KernelFinding, IsGoodOnlyWithPreemptRt) {
  Machine rt, marked, standard;
  rt.with("proc/sys/kernel/osrelease", "6.1.0-rt").with("sys/kernel/realtime", "1");
  marked.with("proc/version", "Linux version 6.12.1 (x) #1 SMP PREEMPT_RT now");
  standard.with("proc/sys/kernel/osrelease", "6.1.0")
      .with("proc/version", "Linux version 6.1.0 #1 SMP PREEMPT_DYNAMIC");
  EXPECT_EQ(kernel_finding(rt.root).verdict, Verdict::kGood);
  EXPECT_EQ(kernel_finding(rt.root).measured, "6.1.0-rt, preemption PREEMPT_RT");
  EXPECT_EQ(kernel_finding(marked.root).verdict, Verdict::kGood);
  const Finding usable = kernel_finding(standard.root);
  EXPECT_EQ(usable.verdict, Verdict::kUsable);
  EXPECT_EQ(usable.measured, "6.1.0, preemption PREEMPT_DYNAMIC");
  EXPECT_NE(usable.cure.find("linux-image-rt"), std::string::npos);
}

TEST(GovernorFinding, IsGoodWhenEveryProcessorRunsAtFullSpeed) {
  Machine none, performance, mixed;
  EXPECT_EQ(governor_finding(none.root).verdict, Verdict::kAbsent);
  for (const char* cpu : {"cpu0", "cpu1"})
    performance.with(std::string("sys/devices/system/cpu/") + cpu + "/cpufreq/scaling_governor", "performance");
  EXPECT_EQ(governor_finding(performance.root).verdict, Verdict::kGood);
  mixed.with("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance")
      .with("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave");
  const Finding found = governor_finding(mixed.root);
  EXPECT_EQ(found.verdict, Verdict::kUsable);
  EXPECT_EQ(found.measured, "performance, powersave");
}

Finding with_latency(Duration worst) {
  Histogram wake_up;
  for (int i = 0; i < 99; ++i) wake_up.add(5us);
  wake_up.add(worst);
  return latency_finding(wake_up);
}

TEST(LatencyFinding, JudgesTheWorstWakeUpAndNotTheUsualOne) {
  EXPECT_EQ(with_latency(50us).verdict, Verdict::kGood);
  EXPECT_EQ(with_latency(51us).verdict, Verdict::kUsable);
  EXPECT_EQ(with_latency(500us).verdict, Verdict::kUsable);
  EXPECT_EQ(with_latency(501us).verdict, Verdict::kBad);
  EXPECT_NE(with_latency(501us).measured.find("max 501 us"), std::string::npos) << with_latency(501us).measured;
  EXPECT_FALSE(with_latency(501us).cure.empty());
}

/// A machine that stands still leaves out as many as it is late for, and no more.
TEST(LatencyTest, WakesAThousandTimesASecond) {
  RealTimeSettings settings;
  settings.lock_memory = false;
  const Histogram wake_up = measure_wake_up(settings, 200ms);
  const auto count = static_cast<double>(wake_up.count());
  EXPECT_LE(count, 200);
  EXPECT_GE(count * (1 + seconds(wake_up.mean()) / seconds(1ms)), 199.999);
}

TEST(DiskFinding, ComparesWithWhatTheCamerasDeliver) {
  EXPECT_EQ(disk_finding(100e6, 50e6).verdict, Verdict::kGood);
  EXPECT_EQ(disk_finding(99e6, 50e6).verdict, Verdict::kUsable);
  EXPECT_FALSE(disk_finding(99e6, 50e6).refused);
  EXPECT_EQ(disk_finding(49e6, 50e6).verdict, Verdict::kBad);
  EXPECT_TRUE(disk_finding(49e6, 50e6).refused) << "frames would be dropped";
  const TemporaryFolder folder;
  EXPECT_GT(measure_disk(folder.path(), 1 << 20), 0);
  EXPECT_TRUE(fs::is_empty(folder.path())) << "its file is gone";
  EXPECT_THROW(measure_disk(folder.path() / "no", 1), InputError);
}

TEST(RoomFinding, RefusesADiskThatCannotHoldTheScan) {
  EXPECT_EQ(room_finding("sessions", 100'000'000, 100'000'000).verdict, Verdict::kGood);
  const Finding full = room_finding("sessions", 99'999'999, 100'000'000);
  EXPECT_EQ(full.verdict, Verdict::kBad);
  EXPECT_TRUE(full.refused);
  EXPECT_EQ(full.measured, "a scan needs up to 100 MB, the disk of sessions has 99 MB free");
  EXPECT_NE(full.cure.find("--out"), std::string::npos) << full.cure;
  EXPECT_FALSE(room_finding("sessions", {}, 100'000'000).refused) << "a disk that does not tell";
}

TEST(FreeSpace, IsThatOfTheDiskTheFolderWillBeOn) {
  const TemporaryFolder folder;
  EXPECT_GT(free_space(folder.path() / "to/be/made"), std::uint64_t{0});
  EXPECT_EQ(free_space("/proc/to/be/made"), std::nullopt) << "no disk at all";
}

CanLink controller(int bitrate) {
  CanLink link;
  link.kind = "can";
  link.bitrate = bitrate;
  link.restart_ms = 100;
  link.state = CanState::kErrorActive;
  return link;
}

TEST(CanFinding, TellsAbsentDownWrongRateBusOffOverloadedAndAShortQueue) {
  const CanNeed need{"can0", 1'000'000, 0.5};
  Machine none, down, up, shallow;
  down.with("sys/class/net/can0/operstate", "down").with("sys/class/net/can0/tx_queue_len", "10");
  up.with("sys/class/net/can0/operstate", "up").with("sys/class/net/can0/tx_queue_len", "100");
  shallow.with("sys/class/net/can0/operstate", "up").with("sys/class/net/can0/tx_queue_len", "8");
  const auto expect = [&](const Finding& f, Verdict verdict, bool refused, const char* cure) {
    EXPECT_EQ(f.verdict, verdict) << f.measured;
    EXPECT_EQ(f.refused, refused) << f.measured;
    EXPECT_NE(f.cure.find(cure), std::string::npos) << f.cure;
  };
  expect(can_finding(none.root, need, {}), Verdict::kAbsent, true, "plug the adapter in");
  expect(can_finding(down.root, need, {}), Verdict::kBad, true, "ip link set can0 up type can bitrate 1000000");
  expect(can_finding(up.root, need, controller(500'000)), Verdict::kBad, true, "bitrate 1000000");
  expect(can_finding(up.root, need, controller(1'000'000)), Verdict::kGood, false, "");
  EXPECT_EQ(can_finding(up.root, need, controller(1'000'000)).measured, "1000000 bit/s, queue 100 frames, load 50 %");
  CanLink off = controller(1'000'000);
  off.state = CanState::kBusOff;
  expect(can_finding(down.root, need, off), Verdict::kBad, true, "type can restart");
  expect(can_finding(up.root, {"can0", 1'000'000, 0.8}, controller(1'000'000)), Verdict::kBad, true,
         "exchange_rate_hz");
  expect(can_finding(shallow.root, need, controller(1'000'000)), Verdict::kBad, false, "no room for rest");
  shallow.with("sys/class/net/can0/tx_queue_len", "10");
  expect(can_finding(shallow.root, need, controller(1'000'000)), Verdict::kUsable, false, "the guardian's rest");
  CanLink by_hand = controller(1'000'000);
  by_hand.restart_ms = 0;
  expect(can_finding(up.root, need, by_hand), Verdict::kUsable, false, "restart-ms 100");
  EXPECT_EQ(can_finding(none.root, {"unix:/x", 1, 0.1}, {}).verdict, Verdict::kGood);
  const Finding crowded = can_finding(up.root, need, controller(1'000'000), 0.3);
  expect(crowded, Verdict::kBad, false, "candump can0");
  EXPECT_EQ(crowded.measured, "1000000 bit/s, queue 100 frames, load 50 %, and 30 % there now");
  expect(can_finding(up.root, need, controller(1'000'000), 0.1), Verdict::kGood, false, "");
}

TEST(BusLoad, IsWhatTheKernelsCountsGrowByAgainstTheBitRate) {
  Machine machine;
  EXPECT_FALSE(can_traffic(machine.root, "can0", Stamp{}));
  const std::string counts = "sys/class/net/can0/statistics/";
  const auto at = [&](const char* rx, const char* rx_bytes, Stamp now) {
    machine.with(counts + "rx_packets", rx).with(counts + "rx_bytes", rx_bytes);
    machine.with(counts + "tx_packets", "10").with(counts + "tx_bytes", "80");
    return can_traffic(machine.root, "can0", now).value();
  };
  const CanTraffic before = at("1000", "8000", Stamp{0}), after = at("3000", "24000", Stamp{2'000'000'000});
  EXPECT_EQ(before.frames, 1010u);
  EXPECT_EQ(before.bytes, 8080u);
  EXPECT_NEAR(bus_load(before, after, 1'000'000), 1000 * (47 + 64) * 1.1 / 1e6, 1e-12);
}

TEST(SerialFinding, TellsAbsentTakenAndFree) {
  Machine machine;
  EXPECT_EQ(serial_finding(machine.root, "laser", "/dev/ttyUSB0").verdict, Verdict::kAbsent);
  machine.with("dev/ttyUSB0", "");
  EXPECT_EQ(serial_finding(machine.root, "laser", "/dev/ttyUSB0").verdict, Verdict::kGood);
  machine.with("proc/77/comm", "minicom");
  fs::create_directories(machine.root / "proc/77/fd");
  fs::create_symlink(fs::canonical(machine.root / "dev/ttyUSB0"), machine.root / "proc/77/fd/3");
  const Finding taken = serial_finding(machine.root, "laser", "/dev/ttyUSB0");
  EXPECT_EQ(taken.verdict, Verdict::kBad);
  EXPECT_EQ(taken.measured, "/dev/ttyUSB0 is taken by minicom (pid 77)");
  EXPECT_TRUE(taken.refused);
}

TEST(V4l2Finding, NamesTheDevice) {
  Machine machine;
  EXPECT_TRUE(v4l2_finding(machine.root, "mono", "/dev/video0").refused);
  machine.with("dev/video0", "").with("sys/class/video4linux/video0/name", "Frame grabber");
  EXPECT_EQ(v4l2_finding(machine.root, "mono", "/dev/video0").measured, "/dev/video0: Frame grabber");
}

TEST(NetworkFindings, CompareBufferAndPacketsWithTheCameras) {
  Machine machine;
  machine.with("proc/sys/net/core/rmem_max", "212992");
  EXPECT_EQ(receive_buffer_finding(machine.root, 1e6).verdict, Verdict::kGood);
  const Finding small = receive_buffer_finding(machine.root, 46e6);
  EXPECT_EQ(small.verdict, Verdict::kUsable);
  EXPECT_NE(small.cure.find("net.core.rmem_max=9200000"), std::string::npos) << small.cure;
  EXPECT_EQ(mtu_finding("left", "eth1", 9000, 9000).verdict, Verdict::kGood);
  EXPECT_EQ(mtu_finding("left", "eth1", 1500, 1500).verdict, Verdict::kUsable);
  EXPECT_TRUE(mtu_finding("left", "eth1", 1500, 9000).refused);
  EXPECT_FALSE(interface_towards("not an address"));
}

TEST(SleepFinding, IsGoodWhereTheCycleMayKeepProcessorsAwake) {
  Machine none, may, may_not;
  none.with("sys/devices/system/cpu/cpuidle/current_driver", "none");
  for (Machine* machine : {&may, &may_not})
    machine->with("sys/devices/system/cpu/cpuidle/current_driver", "intel_idle");
  may.with("dev/cpu_dma_latency", "");
  EXPECT_EQ(sleep_finding(none.root).verdict, Verdict::kAbsent);
  EXPECT_EQ(sleep_finding(may.root).verdict, Verdict::kGood);
  const Finding found = sleep_finding(may_not.root);
  EXPECT_EQ(found.verdict, Verdict::kUsable);
  EXPECT_NE(found.cure.find("99-tankrig.rules"), std::string::npos) << found.cure;
  EXPECT_FALSE(found.refused);
}

TEST(PlatformFacts, SayWhatTheSystemGave) {
  Machine machine;
  machine.with("proc/sys/kernel/osrelease", "6.1.0-rt").with("sys/kernel/realtime", "1");
  RealTimeSettings settings;
  settings.cpu = 3;
  const auto facts = platform_facts(machine.root, settings, {true, true, true, true});
  EXPECT_EQ(facts.at("kernel"), "6.1.0-rt");
  EXPECT_EQ(facts.at("preemption"), "PREEMPT_RT");
  EXPECT_EQ(facts.at("scheduling"), "SCHED_FIFO 80");
  EXPECT_EQ(facts.at("memory"), "locked");
  EXPECT_EQ(facts.at("processor"), "3");
  EXPECT_EQ(facts.at("sleep"), "kept off");
  EXPECT_EQ(platform_facts(machine.root, settings, {}).at("scheduling"), "not real time");
}

}  // namespace
}  // namespace tankrig
