// Sees what a thread does that keeps time: allocations, locks, exceptions, calls of the kernel, page faults.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace tankrig::testing_support {

/// What one thread did while it was watched.
struct Misdeeds {
  std::uint64_t allocations = 0;  ///< malloc and its kin, free
  std::uint64_t locks = 0;        ///< mutexes and read-write locks taken, waited for or not
  std::uint64_t exceptions = 0;   ///< thrown, caught or not
  std::uint64_t calls = 0;        ///< system calls that are neither the sleep nor surely without a wait
  long first_call = -1;           ///< number of the first of them
  std::uint64_t page_faults = 0;  ///< minor and major
  std::uint64_t sleeps = 0;       ///< clock_nanosleep on CLOCK_MONOTONIC with TIMER_ABSTIME: the cycle's own
  std::uint64_t messages = 0;     ///< sent and received without a wait
};

std::string to_string(const Misdeeds& deeds);

/// Why this build or this kernel cannot watch; empty if it can.
std::string why_no_watch();

/// Watches the thread that calls begin() until it calls end(). Every system call of the thread is caught by the
/// kernel's Syscall User Dispatch, judged, and then made as it was meant: nothing the thread does turns out otherwise.
///
/// Allowed are the sleep; clock_gettime, where the clock needs the kernel; and what cannot wait: send, sendto, sendmsg,
/// recv, recvfrom, recvmsg with MSG_DONTWAIT, read and write on a descriptor with O_NONBLOCK, and poll with a time of
/// 0. That is how the cycle talks: to a CAN bus (a socket), to a serial line, which it asks first whether it has hung
/// up, and to a device's thread (an eventfd that wakes it).
/// Threads: one watched at a time.
class CycleWatch {
 public:
  static void begin() noexcept;
  static Misdeeds end() noexcept;
};

}  // namespace tankrig::testing_support
