#include "rig/safety/emergency.hpp"

#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <exception>

#include "rig/safety/stop_key.hpp"

namespace tankrig {
namespace {

constexpr int kCrashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP};
constexpr Duration kPeriod = std::chrono::milliseconds{20};
constexpr unsigned kGiveUp = 1;  // [s]

std::atomic<Laser*> laser_of_last_resort{nullptr};
std::atomic<Arm*> arm_of_last_resort{nullptr};
std::atomic<bool> declared{false};
std::terminate_handler terminate_before = nullptr;

/// Laser first, in every round; whoever comes second in a dying program waits for the first to end it.
void force_safe() noexcept {
  if (declared.exchange(true)) {
    while (true) ::pause();
  }
  std::signal(SIGALRM, SIG_DFL);
  ::alarm(kGiveUp);
  sigset_t give_up;
  ::sigemptyset(&give_up);
  ::sigaddset(&give_up, SIGALRM);
  ::pthread_sigmask(SIG_UNBLOCK, &give_up, nullptr);  // whoever started the program may have left it blocked
  Laser* const laser = laser_of_last_resort;
  Arm* const arm = arm_of_last_resort;
  for (Duration passed{0}; (laser || arm) && passed < EmergencyStop::kLasts; passed += kPeriod) {
    if (laser) laser->last_resort();
    if (arm) arm->last_resort();
    StopKey::restore();
    timespec left{0, kPeriod.count()};
    while (::nanosleep(&left, &left) != 0 && errno == EINTR) {
    }
  }
  StopKey::restore();
}

extern "C" void die_of(int signal) { end_safely(signal); }

[[noreturn]] void die_of_terminate() {
  force_safe();
  std::signal(SIGABRT, SIG_DFL);
  if (terminate_before) terminate_before();
  std::abort();
}

}  // namespace

EmergencyStop::EmergencyStop(Laser& laser, Arm& arm) {
  laser_of_last_resort = &laser;
  arm_of_last_resort = &arm;
  terminate_before = std::set_terminate(die_of_terminate);
  for (const int signal : kCrashes) std::signal(signal, die_of);
}

EmergencyStop::~EmergencyStop() {
  laser_of_last_resort = nullptr;
  arm_of_last_resort = nullptr;
  while (declared) ::pause();  // another thread is at the devices, and ends the program
  for (const int signal : kCrashes) std::signal(signal, SIG_DFL);
  std::set_terminate(terminate_before);
}

void end_safely(int signal) noexcept {
  force_safe();
  const int last = signal == SIGTSTP ? SIGTERM : signal;
  std::signal(last, SIG_DFL);
  std::raise(last);
}

bool emergency_declared() noexcept { return declared.load(std::memory_order_relaxed); }

}  // namespace tankrig
