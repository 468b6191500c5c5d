// The machine under the cycle: kernel, processor, rights, wake-up latency, disk speed.
//
// Functions with a root folder read /proc and /sys below it: "/", or a copy in a test.
#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include "core/histogram.hpp"
#include "rig/platform/finding.hpp"
#include "rig/platform/real_time.hpp"

namespace tankrig {

/// PREEMPT_RT is good, any other is usable.
Finding kernel_finding(const std::filesystem::path& root);
/// "performance" on every processor is good, another governor usable. A machine without frequency scaling has none.
Finding governor_finding(const std::filesystem::path& root);

/// Good if the cycle may keep the processors out of deep sleep. A machine without sleep states needs nothing.
Finding sleep_finding(const std::filesystem::path& root);

Finding privileges_finding(const RealTimeSettings& settings);
Finding memory_lock_finding(const RealTimeSettings& settings);

/// Largest wake-up latency in the classes of LinuxCNC's latency test (docs/src/install/latency-test.adoc): up to 50 us
/// good, up to 500 us usable, beyond it bad.
Finding latency_finding(const Histogram& wake_up);
inline constexpr Duration kGoodLatency = std::chrono::microseconds(50), kUsableLatency = std::chrono::microseconds(500);

/// Wakes a thread of its own, with the cycle's priority and processor, at 1 kHz for `duration`.
Histogram measure_wake_up(const RealTimeSettings& settings, Duration duration);

/// Good from twice the cameras' data rate, usable from once; below that bad, and no rig can run.
/// Units: bytes/s.
Finding disk_finding(double measured, double needed);
/// Writes `bytes` into its own file in `folder`, waits for the disk, and removes the file.
/// Errors: InputError if the folder cannot be written to.
double measure_disk(const std::filesystem::path& folder, std::size_t bytes);

/// `folder`, or its nearest existing parent.
std::filesystem::path existing_parent(std::filesystem::path folder);
/// Free bytes on the disk of `folder`, which need not exist yet; nothing if unknown.
std::optional<std::uint64_t> free_space(const std::filesystem::path& folder);
/// Bad, and no rig can run, if the disk of `folder` has fewer than `needed` bytes free.
Finding room_finding(const std::filesystem::path& folder, std::optional<std::uint64_t> free, std::uint64_t needed);

/// For the session: kernel, preemption, governor, sleep, scheduling, memory, processor.
std::map<std::string, std::string> platform_facts(const std::filesystem::path& root, const RealTimeSettings& settings,
                                                  const RealTimeGrant& granted);

}  // namespace tankrig
