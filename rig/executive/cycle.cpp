#include "rig/executive/cycle.hpp"

#include "core/thread_priority.hpp"

namespace tankrig {
namespace {

constexpr int kPriority = 50;

}  // namespace

Cycle::Cycle(Executive& executive, Clock& clock, Duration period)
    : executive_(executive), clock_(clock), period_(period), grid_(clock.now(), period) {}

void Cycle::step() noexcept {
  clock_.sleep_until(grid_.next());
  executive_.step(clock_.now());
  grid_.advance(clock_.now());
  steps_.fetch_add(1, std::memory_order_release);
  overruns_.store(grid_.overruns(), std::memory_order_relaxed);
  missed_.store(grid_.missed_cycles(), std::memory_order_relaxed);
}

void Cycle::begin() {
  if (!clock_.real_time() || thread_.joinable() || ending_.load(std::memory_order_relaxed)) return;
  thread_ = std::thread([this] {
    keep_time("tankrig-cycle", kPriority);
    while (!ending_.load(std::memory_order_relaxed)) step();
  });
}

void Cycle::turn() noexcept {
  if (!thread_.joinable()) {
    step();
    return;
  }
  do clock_.sleep_until(clock_.now() + period_);
  while (steps_.load(std::memory_order_acquire) == 0);
}

void Cycle::end() noexcept {
  ending_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

}  // namespace tankrig
