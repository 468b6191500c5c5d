#include "rig/safety/emergency.hpp"

#include <time.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <exception>

#include "rig/safety/stop_key.hpp"

namespace tankrig {
namespace {

constexpr int kCrashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
constexpr Duration kPeriod = std::chrono::milliseconds{20};
constexpr unsigned kGiveUp = 1;  // [s]

std::atomic<Laser*> laser_of_last_resort{nullptr};
std::atomic<Arm*> arm_of_last_resort{nullptr};
std::atomic<bool> declared{false};
std::terminate_handler terminate_before = nullptr;

/// Laser first, in every round; whoever comes second in a dying program waits for the first to end it.
void make_safe() noexcept {
  if (declared.exchange(true)) {
    while (true) ::pause();
  }
  std::signal(SIGALRM, SIG_DFL);
  ::alarm(kGiveUp);
  for (Duration passed{0}; passed < EmergencyStop::kLasts; passed += kPeriod) {
    if (Laser* laser = laser_of_last_resort) [[maybe_unused]]
      const Status dark = laser->set(false);
    if (Arm* arm = arm_of_last_resort) [[maybe_unused]]
      const Status rest = arm->stop();
    timespec left{0, kPeriod.count()};
    ::nanosleep(&left, nullptr);
  }
  StopKey::restore();
}

extern "C" void die_of(int signal) {
  make_safe();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

[[noreturn]] void die_of_terminate() {
  make_safe();
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
  for (const int signal : kCrashes) std::signal(signal, SIG_DFL);
  std::set_terminate(terminate_before);
  laser_of_last_resort = nullptr;
  arm_of_last_resort = nullptr;
}

bool emergency_declared() noexcept { return declared.load(std::memory_order_relaxed); }

}  // namespace tankrig
