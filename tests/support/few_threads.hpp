// A process whose next threads find no room: what a program does that cannot have one.
#pragma once

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>

namespace tankrig::testing_support {

/// From now on this process has room for the stacks of so many more threads: for a child that ends soon. False if the
/// system refuses.  Not under a sanitizer, whose own memory it would limit.
inline bool allow_threads(std::size_t threads) {
  constexpr std::size_t kStack = std::size_t{1} << 30;
  pthread_attr_t attributes;
  if (::pthread_attr_init(&attributes) != 0 || ::pthread_attr_setstacksize(&attributes, kStack) != 0 ||
      ::pthread_setattr_default_np(&attributes) != 0)
    return false;
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t room = pages * static_cast<std::size_t>(::getpagesize()) + threads * kStack + kStack / 2;
  const rlimit limit{room, room};
  return ::setrlimit(RLIMIT_AS, &limit) == 0;
}

}  // namespace tankrig::testing_support
