// The program's own malloc, mutexes and __cxa_throw, which count and then call the real ones; and its door to the
// kernel.
#include "tests/real_time/cycle_watch.hpp"

#include <cxxabi.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <typeinfo>

#include "tests/support/sanitizers.hpp"

#if defined(__x86_64__) && defined(__GLIBC__) && !TANKRIG_SANITIZED
#define TANKRIG_CAN_WATCH 1
#else
#define TANKRIG_CAN_WATCH 0
#endif

#ifndef PR_SET_SYSCALL_USER_DISPATCH
#define PR_SET_SYSCALL_USER_DISPATCH 59
#define PR_SYS_DISPATCH_OFF 0
#define PR_SYS_DISPATCH_ON 1
#endif

namespace tankrig::testing_support {

std::string to_string(const Misdeeds& d) {
  const auto count = [](const char* what, std::uint64_t n) { return std::string(what) + std::to_string(n); };
  return count("allocations ", d.allocations) + count(", locks ", d.locks) + count(", exceptions ", d.exceptions) +
         count(", system calls ", d.calls) + " (first: number " + std::to_string(d.first_call) + ")" +
         count(", page faults ", d.page_faults) + count(", sleeps ", d.sleeps) + count(", messages ", d.messages);
}

#if TANKRIG_CAN_WATCH

namespace {

constexpr char kAllow = 0, kCatch = 1;  // SYSCALL_DISPATCH_FILTER_ALLOW, _BLOCK

thread_local bool t_watched = false;
volatile char g_door = kAllow;
Misdeeds g_deeds;  // the watched thread's
std::uint64_t g_faults_before = 0;

long kernel(long number, long a, long b, long c, long d = 0, long e = 0, long f = 0) noexcept {
  long result = number;
  register long r10 asm("r10") = d;
  register long r8 asm("r8") = e;
  register long r9 asm("r9") = f;
  asm volatile("syscall" : "+a"(result) : "D"(a), "S"(b), "d"(c), "r"(r10), "r"(r8), "r"(r9) : "rcx", "r11", "memory");
  return result;
}

bool never_waits(long descriptor) noexcept { return kernel(SYS_fcntl, descriptor, F_GETFL, 0) & O_NONBLOCK; }

void judge(long number, long a, long b, long c, long d) noexcept {
  switch (number) {
    case SYS_clock_gettime:
      return;
    case SYS_clock_nanosleep:
      if (a != CLOCK_MONOTONIC || b != TIMER_ABSTIME) break;
      ++g_deeds.sleeps;
      return;
    case SYS_sendto:
    case SYS_recvfrom:
      if (!(d & MSG_DONTWAIT)) break;
      ++g_deeds.messages;
      return;
    case SYS_sendmsg:
    case SYS_recvmsg:
      if (!(c & MSG_DONTWAIT)) break;
      ++g_deeds.messages;
      return;
    case SYS_read:
    case SYS_write:
      if (!never_waits(a)) break;
      ++g_deeds.messages;
      return;
    case SYS_getsockopt:
      return;
    case SYS_poll:
      if (c != 0) break;  // milliseconds
      return;
    case SYS_ioctl:
      if (b != FIONREAD) break;  // how many bytes wait
      return;
    default:
      break;
  }
  if (g_deeds.calls++ == 0) g_deeds.first_call = number;
}

void caught(int, siginfo_t*, void* context) {
  g_door = kAllow;
  auto& regs = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  const long number = regs[REG_RAX];
  judge(number, regs[REG_RDI], regs[REG_RSI], regs[REG_RDX], regs[REG_R10]);
  regs[REG_RAX] =
      kernel(number, regs[REG_RDI], regs[REG_RSI], regs[REG_RDX], regs[REG_R10], regs[REG_R8], regs[REG_R9]);
  g_door = kCatch;
}

/// Where the handler returns to the kernel: that one call must pass.
unsigned long return_door() noexcept {
  struct sigaction handle {};
  handle.sa_sigaction = caught;
  handle.sa_flags = SA_SIGINFO;
  ::sigaction(SIGSYS, &handle, nullptr);
  struct {
    void* handler;
    unsigned long flags;
    unsigned long restorer;
    unsigned long mask;
  } known{};
  kernel(SYS_rt_sigaction, SIGSYS, 0, reinterpret_cast<long>(&known), 8);
  return known.restorer;
}

bool set_dispatch(bool on, unsigned long passes) noexcept {
  return kernel(SYS_prctl, PR_SET_SYSCALL_USER_DISPATCH, on ? PR_SYS_DISPATCH_ON : PR_SYS_DISPATCH_OFF,
                on ? static_cast<long>(passes) : 0, on ? 16 : 0, on ? reinterpret_cast<long>(&g_door) : 0) == 0;
}

std::uint64_t faults() noexcept {
  rusage used{};
  ::getrusage(RUSAGE_THREAD, &used);
  return static_cast<std::uint64_t>(used.ru_minflt + used.ru_majflt);
}

/// The function of that name that ours stands before; `known` keeps it. No guarded static: that one might lock.
template <class Function>
Function* real(std::atomic<Function*>& known, const char* name) noexcept {
  Function* function = known.load(std::memory_order_relaxed);
  if (!function) known = function = reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
  return function;
}

}  // namespace

std::string why_no_watch() {
  g_door = kAllow;
  if (!set_dispatch(true, return_door())) return "this kernel has no Syscall User Dispatch (Linux 5.11, x86-64)";
  set_dispatch(false, 0);
  return {};
}

void CycleWatch::begin() noexcept {
  g_door = kAllow;
  g_deeds = {};
  set_dispatch(true, return_door());
  g_faults_before = faults();
  g_faults_before = faults();  // the first call may have touched a page itself
  t_watched = true;
  g_door = kCatch;
}

Misdeeds CycleWatch::end() noexcept {
  g_door = kAllow;
  t_watched = false;
  g_deeds.page_faults = faults() - g_faults_before;
  set_dispatch(false, 0);
  return g_deeds;
}

#else

std::string why_no_watch() { return "malloc and the kernel's door are watched on x86-64 glibc, without a sanitizer"; }
void CycleWatch::begin() noexcept {}
Misdeeds CycleWatch::end() noexcept { return {}; }

#endif

}  // namespace tankrig::testing_support

#if TANKRIG_CAN_WATCH

using tankrig::testing_support::g_deeds;
using tankrig::testing_support::real;
using tankrig::testing_support::t_watched;

extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t bytes) {
  if (t_watched) ++g_deeds.allocations;
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  if (t_watched) ++g_deeds.allocations;
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  if (t_watched) ++g_deeds.allocations;
  return __libc_realloc(memory, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  if (t_watched) ++g_deeds.allocations;
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return memalign(alignment, bytes); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  *memory = memalign(alignment, bytes);
  return *memory ? 0 : ENOMEM;
}
void free(void* memory) {
  if (t_watched && memory) ++g_deeds.allocations;
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static std::atomic<int (*)(pthread_mutex_t*)> known{nullptr};
  if (t_watched) ++g_deeds.locks;
  return real(known, "pthread_mutex_lock")(mutex);
}
int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) {
  static std::atomic<int (*)(pthread_mutex_t*, const timespec*)> known{nullptr};
  if (t_watched) ++g_deeds.locks;
  return real(known, "pthread_mutex_timedlock")(mutex, until);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) {
  static std::atomic<int (*)(pthread_rwlock_t*)> known{nullptr};
  if (t_watched) ++g_deeds.locks;
  return real(known, "pthread_rwlock_rdlock")(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) {
  static std::atomic<int (*)(pthread_rwlock_t*)> known{nullptr};
  if (t_watched) ++g_deeds.locks;
  return real(known, "pthread_rwlock_wrlock")(lock);
}
}

void __cxxabiv1::__cxa_throw(void* thrown, std::type_info* type, void (*destroy)(void*)) {
  static std::atomic<void (*)(void*, std::type_info*, void (*)(void*))> known{nullptr};
  if (t_watched) ++g_deeds.exceptions;
  real(known, "__cxa_throw")(thrown, type, destroy);
  std::abort();
}

#endif
