#include "apps/tankrig/stop.hpp"

#include <unistd.h>

#include <csignal>

namespace tankrig::app {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<int> times_asked{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);  // set by a handler

/// Asked twice in a row is asked once: the end takes its time. The third time the program is left to its fate.
constexpr int kImpatient = 3;

extern "C" void request_stop(int signal) {
  stop_requested.store(true);
  if (times_asked.fetch_add(1) + 1 < kImpatient) return;
  StopKey::restore();
  std::signal(signal, SIG_DFL);
}

// A program that is suspended supervises nothing: that too is a stop.
constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP};

}  // namespace

StopOnSignal::StopOnSignal() {
  struct sigaction action {};
  action.sa_handler = request_stop;
  for (int signal : kSignals) sigaction(signal, &action, nullptr);
}

StopOnSignal::~StopOnSignal() {
  for (int signal : kSignals) std::signal(signal, SIG_DFL);
}

const std::atomic<bool>& StopOnSignal::requested() { return stop_requested; }

RigStops::RigStops(Backend& backend, Progress& progress)
    : emergency_(backend.laser(), backend.arm()), key_(STDIN_FILENO, stop_requested) {
  if (key_.active()) progress.note("space, Enter or q stops: laser off, arm at rest");
}

}  // namespace tankrig::app
