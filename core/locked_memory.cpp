#include "core/locked_memory.hpp"

#include <linux/capability.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>

namespace tankrig {
namespace {

constexpr std::size_t kPage = 4096, kStack = 256 * 1024, kHeapReserve = 8 * 1024 * 1024;
constexpr int kLargestHeapBlock = 32 * 1024 * 1024;  // glibc takes no more

void touch(volatile char* bytes, std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; i += kPage) bytes[i] = 0;
}

/// Blocks of any size come from the heap and go back to it: neither a fresh page nor a mapping that changes under a
/// running thread.
void keep_heap() noexcept {
  keep_freed_memory();
  if (void* reserve = std::malloc(kHeapReserve)) {
    touch(static_cast<char*>(reserve), kHeapReserve);
    std::free(reserve);
  }
}

bool has_capability(unsigned capability) noexcept {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[2]{};
  if (::syscall(SYS_capget, &header, data) != 0) return false;
  return (data[capability / 32].effective >> (capability % 32)) & 1U;
}

}  // namespace

bool may_lock_memory() noexcept {
  rlimit limit{};
  return has_capability(CAP_IPC_LOCK) || (::getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
}

void keep_freed_memory() noexcept {
  ::mallopt(M_MMAP_THRESHOLD, kLargestHeapBlock);
  ::mallopt(M_TRIM_THRESHOLD, -1);
}

LockedMemory::LockedMemory() noexcept {
  if (!may_lock_memory()) return;
  keep_heap();
  // What is mapped later is not filled at once: every new thread's stack would be, whole.
  locked_ = ::mlockall(MCL_CURRENT) == 0 && ::mlockall(MCL_FUTURE | MCL_ONFAULT) == 0;
}

LockedMemory::~LockedMemory() {
  if (locked_) ::munlockall();
}

[[gnu::noinline]] void touch_stack() noexcept {
  char bytes[kStack];
  touch(bytes, sizeof bytes);
}

}  // namespace tankrig
