// The machine under the cycle: kernel, processor, rights, how punctually it wakes a thread, how fast its disk is.
//
// Functions of a root folder read /proc and /sys below it: "/", or a copy in a test.
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
/// "performance" on every processor is good, any other governor usable; a machine without frequency scaling shows none.
Finding governor_finding(const std::filesystem::path& root);

/// Good if the cycle may keep the processors out of deep sleep; a machine without sleep states shows none.
Finding sleep_finding(const std::filesystem::path& root);

Finding privileges_finding(const RealTimeSettings& settings);
Finding memory_lock_finding(const RealTimeSettings& settings);

/// Largest wake-up latency in the classes of LinuxCNC's latency test (docs/src/install/latency-test.adoc): up to 50 us
/// good, up to 500 us usable, beyond it bad.
Finding latency_finding(const Histogram& wake_up);
inline constexpr Duration kGoodLatency = std::chrono::microseconds(50), kUsableLatency = std::chrono::microseconds(500);

/// Wakes a thread of its own, with the cycle's priority and processor, at 1 kHz for `duration`.
Histogram measure_wake_up(const RealTimeSettings& settings, Duration duration);

/// Twice of what the cameras deliver is good, once is usable, less is bad and no rig can run.
/// Units: bytes/s.
Finding disk_finding(double measured, double needed);
/// Writes `bytes` into a file of its own in `folder`, and waits for the disk; the file is removed.
/// Errors: InputError if the folder cannot be written to.
double measure_disk(const std::filesystem::path& folder, std::size_t bytes);

/// `folder`, or the next above it that is there.
std::filesystem::path existing_parent(std::filesystem::path folder);
/// Bytes that may still be written to the disk of `folder`, which may yet have to be made; nothing if it does not tell.
std::optional<std::uint64_t> free_space(const std::filesystem::path& folder);
/// Bad, and no rig can run, if the disk of `folder` has not `needed` bytes free.
Finding room_finding(const std::filesystem::path& folder, std::optional<std::uint64_t> free, std::uint64_t needed);

/// What a session keeps of all this: kernel, preemption, governor, sleep, scheduling, memory, processor.
std::map<std::string, std::string> platform_facts(const std::filesystem::path& root, const RealTimeSettings& settings,
                                                  const RealTimeGrant& granted);

}  // namespace tankrig
