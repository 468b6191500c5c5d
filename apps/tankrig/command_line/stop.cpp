#include "apps/tankrig/command_line/stop.hpp"

#include <unistd.h>

#include <csignal>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/feed.hpp"
#include "core/clock.hpp"

namespace tankrig::app {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<int> times_asked{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);  // set by a handler

int alive = 0;  // of StopOnSignal

/// Asked twice in a row is asked once: the end takes its time.
constexpr int kImpatient = 3;

/// A key that is held repeats, after a second at most: signals of a terminal that are no farther apart are one.
constexpr Duration kHeldKey = std::chrono::seconds{1};
std::atomic<std::int64_t> last_key_ns{std::numeric_limits<std::int64_t>::min() / 2};
std::atomic<int> last_key{0};

bool repeats(int signal) noexcept {
  const std::int64_t now = MonotonicClock::one().now().ns;
  const bool soon = now - last_key_ns.exchange(now) <= kHeldKey.count();
  const bool same = last_key.exchange(signal) == signal;
  return soon && same;
}

extern "C" void request_stop(int signal, siginfo_t* from, void*) {
  stop_requested.store(true);
  if (signal == SIGTTIN || signal == SIGTTOU || emergency_declared()) return;
  if (from->si_code == SI_KERNEL && repeats(signal)) return;
  if (times_asked.fetch_add(1) + 1 >= kImpatient) end_safely(signal);
}

/// A program that is suspended supervises nothing: that too is a stop.
constexpr int kSignals[] = {SIGHUP,  SIGINT, SIGQUIT,   SIGTERM, SIGALRM, SIGUSR1, SIGUSR2, SIGPOLL,
                            SIGPROF, SIGPWR, SIGVTALRM, SIGXCPU, SIGTSTP, SIGTTIN, SIGTTOU, SIGSTKFLT};

void for_every_signal(const struct sigaction& action) {
  for (const int signal : kSignals) sigaction(signal, &action, nullptr);
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) sigaction(signal, &action, nullptr);
}

}  // namespace

StopOnSignal::StopOnSignal() {
  if (++alive > 1) return;
  struct sigaction action {};
  action.sa_sigaction = request_stop;
  action.sa_flags = SA_SIGINFO;
  for_every_signal(action);
}
StopOnSignal::~StopOnSignal() {
  if (--alive > 0 || stop_requested) return;
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  for_every_signal(action);
}

const std::atomic<bool>& StopOnSignal::requested() { return stop_requested; }

std::function<bool()> StopOnSignal::from_now_on() {
  return [requested = stop_requested.load(), times = times_asked.load()] {
    return times_asked.load() > times || (stop_requested.load() && !requested);
  };
}

RigStops::RigStops(Backend& backend, Progress& progress, bool hold_to_run)
    : hold_to_run_(hold_to_run),
      emergency_(backend.laser(), backend.arm()),
      key_(STDIN_FILENO, stop_requested, hold_to_run ? std::optional(HeldKey{}) : std::nullopt) {
  Feed::one().tell({{"feed", "keys"}, {"hold_to_run", key_.active() && hold_to_run}});
  if (key_.active())
    progress.note(hold_to_run ? "hold space: the arm moves while it is held, and q stops"
                              : "space, Enter or q stops: laser off, arm at rest");
  if (!backend.clock().real_time()) return;
  inhibitor_.emplace();
  if (!inhibitor_->missing().empty())
    progress.note("this machine is not kept from being suspended, which would end the scan (" + inhibitor_->missing() +
                  ")");
}

bool RigStops::key_is_held(Clock& clock) const {
  while (hold_to_run_ && key_.active() && !key_.held() && !stop_requested)
    clock.sleep_until(clock.now() + std::chrono::milliseconds{10});
  return !stop_requested;
}

}  // namespace tankrig::app
