// Takes processors away, as a busy host does: for running tests beside.
#include <pthread.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <random>
#include <string_view>
#include <thread>

#include "core/clock.hpp"

namespace tankrig {
namespace {

constexpr char kUsage[] = R"(thief [--seed N] [--longest MS] [--share PERCENT] [--seconds S]
  Holds every processor it may use, each by itself, with SCHED_FIFO at the highest priority: for 5 ms to MS (300) at a
  time, short times more often, PERCENT (10) of the time in all. The same seed (1) draws the same times. Ends after S
  seconds, or by a signal, and says what it took. Needs the right to SCHED_FIFO: root, or `ulimit -r`.
  Example:  thief & ctest --test-dir build -R '^arm$' --repeat until-fail:10; kill %1
)";

struct Plan {
  unsigned seed = 1;
  double longest_ms = 300, share_percent = 10, seconds = 0;
};

bool number(const char* text, double& value, double least, double most) {
  const char* const end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  return error == std::errc() && rest == end && value >= least && value <= most;
}

bool read_plan(int argc, char** argv, Plan& plan) {
  for (int i = 1; i < argc; i += 2) {
    const std::string_view name = argv[i];
    double seed = 0;
    if (i + 1 == argc) return false;
    const char* const value = argv[i + 1];
    if (name == "--seed" && number(value, seed, 0, 4e9))
      plan.seed = static_cast<unsigned>(seed);
    else if (!(name == "--longest" && number(value, plan.longest_ms, 5, 900)) &&
             !(name == "--share" && number(value, plan.share_percent, 0.1, 90)) &&
             !(name == "--seconds" && number(value, plan.seconds, 0, 1e6)))
      return false;
  }
  return true;
}

/// What was taken of a processor.
struct Loot {
  int cpu = 0, times = 0;
  Duration longest{}, all{};
};

class Thief {
 public:
  explicit Thief(const Plan& plan) : plan_(plan) {}

  /// False without the right to it.
  bool begin() {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return false;
    sched_param highest{};
    highest.sched_priority = ::sched_get_priority_max(SCHED_FIFO);
    if (::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &highest) != 0) return false;  // its threads inherit it
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
      if (CPU_ISSET(cpu, &allowed))
        threads_.emplace_back([this, &loot = loot_.emplace_back(Loot{.cpu = cpu})] { steal(loot); });
    return true;
  }

  const std::deque<Loot>& end() {
    ends_ = true;
    for (std::thread& thread : threads_) thread.join();
    return loot_;
  }

 private:
  void steal(Loot& loot) {
    cpu_set_t only;
    CPU_ZERO(&only);
    CPU_SET(loot.cpu, &only);
    (void)::pthread_setaffinity_np(::pthread_self(), sizeof only, &only);
    constexpr double kShortest_ms = 5;
    std::mt19937 random(plan_.seed + static_cast<unsigned>(loot.cpu));
    std::uniform_real_distribution<double> exponent(0, std::log(plan_.longest_ms / kShortest_ms)), part(0, 2);
    MonotonicClock clock;
    while (!ends_) {
      const double held_ms = kShortest_ms * std::exp(exponent(random));
      const double pause_ms = held_ms * (100 / plan_.share_percent - 1) * part(random);
      for (Stamp next = clock.now() + from_seconds(1e-3 * pause_ms); clock.now() < next && !ends_;)
        clock.sleep_until(std::min(next, clock.now() + std::chrono::milliseconds{20}));
      if (ends_) return;
      const Stamp begin = clock.now(), end = begin + from_seconds(1e-3 * held_ms);
      while (clock.now() < end && !ends_) {
      }
      const Duration took = clock.now() - begin;
      ++loot.times;
      loot.longest = std::max(loot.longest, took);
      loot.all += took;
    }
  }

  const Plan plan_;
  std::atomic<bool> ends_{false};
  std::deque<Loot> loot_;
  std::deque<std::thread> threads_;
};

/// Until a signal asks for the end, or the time is over.
void wait_for_end(const sigset_t& signals, double seconds) {
  const timespec time{static_cast<time_t>(seconds), 0};
  (void)(seconds > 0 ? ::sigtimedwait(&signals, nullptr, &time) : ::sigwaitinfo(&signals, nullptr));
}

int run(const Plan& plan) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  Thief thief(plan);
  if (!thief.begin()) {
    std::fprintf(stderr, "thief: may not use SCHED_FIFO: run it as root, or raise `ulimit -r`\n");
    return 1;
  }
  std::printf("thief: seed %u, at most %.0f ms at a time, %.0f %% of each processor\n", plan.seed, plan.longest_ms,
              plan.share_percent);
  std::fflush(stdout);
  const MonotonicClock clock;
  const Stamp begun = clock.now();
  wait_for_end(signals, plan.seconds);
  const double lasted = seconds(clock.now() - begun);
  for (const Loot& loot : thief.end())
    std::printf("thief: processor %d: %d times, %.0f ms at most, %.1f %% of %.0f s\n", loot.cpu, loot.times,
                1e3 * seconds(loot.longest), 100 * seconds(loot.all) / lasted, lasted);
  return 0;
}

}  // namespace
}  // namespace tankrig

int main(int argc, char** argv) {
  tankrig::Plan plan;
  if (!tankrig::read_plan(argc, argv, plan)) {
    std::fputs(tankrig::kUsage, stderr);
    return 2;
  }
  return tankrig::run(plan);
}
