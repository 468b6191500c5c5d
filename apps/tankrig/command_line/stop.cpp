#include "apps/tankrig/command_line/stop.hpp"

#include <unistd.h>

#include <csignal>

namespace tankrig::app {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<int> times_asked{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);  // set by a handler

/// Asked twice in a row is asked once: the end takes its time.
constexpr int kImpatient = 3;

extern "C" void request_stop(int signal) {
  stop_requested.store(true);
  if (signal == SIGTTIN || signal == SIGTTOU || emergency_declared()) return;
  if (times_asked.fetch_add(1) + 1 >= kImpatient) end_safely(signal);
}

/// A program that is suspended supervises nothing: that too is a stop.
constexpr int kSignals[] = {SIGHUP,  SIGINT, SIGQUIT,   SIGTERM, SIGALRM, SIGUSR1, SIGUSR2, SIGPOLL,
                            SIGPROF, SIGPWR, SIGVTALRM, SIGXCPU, SIGTSTP, SIGTTIN, SIGTTOU, SIGSTKFLT};

void for_every_signal(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  for (const int signal : kSignals) sigaction(signal, &action, nullptr);
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) sigaction(signal, &action, nullptr);
}

}  // namespace

StopOnSignal::StopOnSignal() { for_every_signal(request_stop); }
StopOnSignal::~StopOnSignal() { for_every_signal(SIG_DFL); }

const std::atomic<bool>& StopOnSignal::requested() { return stop_requested; }

std::function<bool()> StopOnSignal::from_now_on() {
  return [requested = stop_requested.load(), times = times_asked.load()] {
    return times_asked.load() > times || (stop_requested.load() && !requested);
  };
}

RigStops::RigStops(Backend& backend, Progress& progress)
    : emergency_(backend.laser(), backend.arm()), key_(STDIN_FILENO, stop_requested) {
  if (key_.active()) progress.note("space, Enter or q stops: laser off, arm at rest");
  if (!backend.clock().real_time()) return;
  inhibitor_.emplace();
  if (!inhibitor_->missing().empty())
    progress.note("this machine is not kept from being suspended, which would end the scan (" + inhibitor_->missing() +
                  ")");
}

}  // namespace tankrig::app
