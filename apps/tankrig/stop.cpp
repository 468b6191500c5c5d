#include "apps/tankrig/stop.hpp"

#include <csignal>

namespace tankrig::app {
namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // set from a signal handler

extern "C" void request_stop(int) { stop_requested.store(true); }

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

}  // namespace

StopOnSignal::StopOnSignal() {
  struct sigaction action {};
  action.sa_handler = request_stop;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (int signal : kSignals) sigaction(signal, &action, nullptr);
}

StopOnSignal::~StopOnSignal() {
  for (int signal : kSignals) std::signal(signal, SIG_DFL);
}

const std::atomic<bool>& StopOnSignal::requested() { return stop_requested; }

}  // namespace tankrig::app
