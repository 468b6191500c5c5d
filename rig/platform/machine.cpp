#include "rig/platform/machine.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <thread>
#include <vector>

#include "core/clock.hpp"
#include "core/cpu_latency_request.hpp"
#include "core/input_error.hpp"
#include "core/locked_memory.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "rig/platform/first_line.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr Duration kTestPeriod = std::chrono::milliseconds(1);

std::string kernel_release(const fs::path& root) { return first_line(root / "proc/sys/kernel/osrelease"); }

std::string preemption(const fs::path& root) {
  if (first_line(root / "sys/kernel/realtime") == "1") return "PREEMPT_RT";
  const std::string version = first_line(root / "proc/version");
  for (const char* kind : {"PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"})
    if (version.find(kind) != std::string::npos) return kind;
  return "none";
}

std::set<std::string> governors(const fs::path& root) {
  std::set<std::string> found;
  std::error_code error;
  for (const fs::directory_entry& cpu : fs::directory_iterator(root / "sys/devices/system/cpu", error))
    if (const std::string governor = first_line(cpu.path() / "cpufreq/scaling_governor"); !governor.empty())
      found.insert(governor);
  return found;
}

std::string listed(const std::set<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

double microseconds(Duration d) { return static_cast<double>(d.count()) * 1e-3; }

/// A file that is gone when it is closed.
OwnedDescriptor scratch_file(const fs::path& folder) {
  std::string name = (folder / ".tankrig-doctor-XXXXXX").string();
  OwnedDescriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (!file) throw InputError(folder, std::string("cannot be written to: ") + std::strerror(errno));
  ::unlink(name.c_str());
  return file;
}

}  // namespace

Finding kernel_finding(const fs::path& root) {
  const std::string kind = preemption(root);
  Finding f{"kernel", Verdict::kGood, kernel_release(root) + ", preemption " + kind};
  if (kind == "PREEMPT_RT") return f;
  f.verdict = Verdict::kUsable;
  f.cure =
      "boot a PREEMPT_RT kernel (Debian: apt install linux-image-rt-amd64): this one may wake the cycle milliseconds "
      "late";
  return f;
}

Finding governor_finding(const fs::path& root) {
  const std::set<std::string> found = governors(root);
  if (found.empty()) return {"governor", Verdict::kAbsent, "no frequency scaling to be seen"};
  Finding f{"governor", Verdict::kGood, listed(found)};
  if (found == std::set<std::string>{"performance"}) return f;
  f.verdict = Verdict::kUsable;
  f.cure = "cpupower frequency-set -g performance";
  return f;
}

Finding sleep_finding(const fs::path& root) {
  const std::string driver = first_line(root / "sys/devices/system/cpu/cpuidle/current_driver");
  if (driver.empty() || driver == "none") return {"sleep states", Verdict::kAbsent, "none to be seen"};
  if (::access((root.string() + kLatencyRequests).c_str(), W_OK) == 0)
    return {"sleep states", Verdict::kGood, "kept off while the cycle runs"};
  return {"sleep states", Verdict::kUsable, std::string(kLatencyRequests) + " may not be written",
          "put etc/udev/99-tankrig.rules into /etc/udev/rules.d and start again (docs/reference/real_time.md)"};
}

Finding privileges_finding(const RealTimeSettings& settings) {
  RealTimeSettings without = settings;
  without.lock_memory = false;
  const std::string missing = missing_real_time(without);
  Finding f{"privileges", Verdict::kGood, "SCHED_FIFO at priority " + std::to_string(settings.priority) + " granted"};
  if (settings.cpu) f.measured += ", processor " + std::to_string(*settings.cpu);
  if (missing.empty()) return f;
  f.verdict = Verdict::kBad;
  const std::size_t colon = missing.find(": ", missing.find(": ") + 1);
  f.measured = missing.substr(0, colon);
  f.cure = missing.substr(colon + 2);
  f.refused = settings.required;
  return f;
}

Finding memory_lock_finding(const RealTimeSettings& settings) {
  if (!settings.lock_memory)
    return {"memory lock", Verdict::kUsable, "not asked for", "scan.real_time.lock_memory: true"};
  if (may_lock_memory()) return {"memory lock", Verdict::kGood, "without limit"};
  return {"memory lock", Verdict::kBad, "limited: ulimit -l",
          "put etc/limits.d/tankrig.conf into /etc/security/limits.d and log in again (docs/reference/real_time.md)",
          settings.required};
}

Finding latency_finding(const Histogram& h) {
  Finding f{"wake-up latency", Verdict::kGood,
            fmt::format("max {:.0f} us, p99 {:.0f} us of {}", microseconds(h.max()), microseconds(h.quantile(0.99)),
                        h.count())};
  if (h.max() <= kGoodLatency) return f;
  f.verdict = h.max() <= kUsableLatency ? Verdict::kUsable : Verdict::kBad;
  f.cure = "PREEMPT_RT, governor performance, no other load, a processor of its own (isolcpus, scan.real_time.cpu)";
  return f;
}

Histogram measure_wake_up(const RealTimeSettings& settings, Duration duration) {
  std::optional<LockedMemory> memory;
  if (settings.lock_memory) memory.emplace();
  Histogram wake_up;
  std::thread([&] {
    become_real_time(settings);
    MonotonicClock clock;
    Stamp point = clock.now();
    for (const Stamp end = point + duration; point < end;) {
      point = point + kTestPeriod;
      clock.sleep_until(point);
      const Duration late = clock.now() - point;
      wake_up.add(late);
      point = point + kTestPeriod * (late / kTestPeriod);
    }
  }).join();
  return wake_up;
}

fs::path existing_parent(fs::path folder) {
  folder = fs::absolute(folder);
  while (!fs::exists(folder) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

std::optional<std::uint64_t> free_space(const fs::path& folder) {
  struct statvfs disk {};
  if (::statvfs(existing_parent(folder).c_str(), &disk) != 0 || disk.f_blocks == 0) return std::nullopt;
  return disk.f_bavail * disk.f_frsize;
}

Finding room_finding(const fs::path& folder, std::optional<std::uint64_t> free, std::uint64_t needed) {
  constexpr std::uint64_t kMega = 1'000'000;
  Finding f{"disk space", Verdict::kGood,
            "a scan needs up to " + std::to_string((needed + kMega - 1) / kMega) + " MB, the disk of " +
                folder.string() +
                (free ? " has " + std::to_string(*free / kMega) + " MB free" : " does not say how much is free")};
  if (!free || *free >= needed) return f;
  f.verdict = Verdict::kBad;
  f.cure = "make room there, or record onto another disk: tankrig scan --out";
  f.refused = true;
  return f;
}

Finding disk_finding(double measured, double needed) {
  Finding f{"disk", Verdict::kGood,
            fmt::format("{:.0f} MB/s, the cameras deliver {:.0f} MB/s", measured * 1e-6, needed * 1e-6)};
  if (measured >= 2 * needed) return f;
  f.verdict = measured >= needed ? Verdict::kUsable : Verdict::kBad;
  f.refused = f.verdict == Verdict::kBad;
  f.cure = "record onto a faster disk (--out), or fewer or slower cameras: frames that find no room are dropped";
  return f;
}

double measure_disk(const fs::path& folder, std::size_t bytes) {
  const OwnedDescriptor file = scratch_file(folder);
  const std::vector<char> block(1 << 20, 'x');
  const MonotonicClock clock;
  const Stamp begin = clock.now();
  for (std::size_t written = 0; written < bytes; written += block.size()) {
    const ssize_t taken = ::write(file.get(), block.data(), block.size());
    if (taken != static_cast<ssize_t>(block.size()))
      throw InputError(folder, std::string("cannot be written to: ") + std::strerror(taken < 0 ? errno : ENOSPC));
  }
  if (::fsync(file.get()) != 0) throw InputError(folder, std::string("fsync: ") + std::strerror(errno));
  return static_cast<double>(bytes) / std::max(1e-6, seconds(clock.now() - begin));
}

std::map<std::string, std::string> platform_facts(const fs::path& root, const RealTimeSettings& settings,
                                                  const RealTimeGrant& granted) {
  const std::set<std::string> found = governors(root);
  return {{"kernel", kernel_release(root)},
          {"preemption", preemption(root)},
          {"governor", found.empty() ? "none" : listed(found)},
          {"sleep", granted.processors_awake ? "kept off" : "allowed"},
          {"scheduling", granted.fifo ? "SCHED_FIFO " + std::to_string(settings.priority) : "not real time"},
          {"memory", granted.memory_locked ? "locked" : "not locked"},
          {"processor", settings.cpu && granted.cpu ? std::to_string(*settings.cpu) : "any"}};
}

}  // namespace tankrig
