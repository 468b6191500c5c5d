#include "rig/executive/cycle.hpp"

namespace tankrig {
namespace {

std::atomic<bool> left_behind{false};

}  // namespace

Cycle::Cycle(Executive& executive, Clock& clock, Duration period, const RealTimeSettings& real_time,
             const CyclePatience& patience)
    : executive_(executive),
      clock_(clock),
      period_(period),
      real_time_(real_time),
      patience_(patience),
      grid_(clock.now(), period),
      window_(real_time.overruns, from_seconds(real_time.window)),
      phase_(period),
      silence_(patience.noticed) {}

void Cycle::step() noexcept {
  clock_.sleep_until(grid_.next());
  executive_.step(clock_.now(), clock_.asleep());
  grid_.advance(clock_.now());
  publish();
}

void Cycle::publish() noexcept {
  overruns_.store(grid_.overruns(), std::memory_order_relaxed);
  missed_.store(grid_.missed_cycles(), std::memory_order_relaxed);
  steps_.fetch_add(1, std::memory_order_release);
}

void Cycle::timed_step() noexcept {
  const Stamp point = grid_.next();
  clock_.sleep_until(point);
  const Stamp began = clock_.now();
  executive_.step(began, clock_.asleep());
  const Stamp ended = clock_.now();
  if (grid_.advance(ended) && window_.add(ended)) executive_.too_many_overruns();
  if (real_time_.pace == CyclePace::kDevice)
    if (const Stamp sample = executive_.newest_joints(); sample.ns != 0) grid_.shift(phase_.steer(began - sample));
  times_->wake_up.add(began - point);
  wake_ups_.add(began - point);
  times_->execution.add(ended - began);
  if (began_) times_->period.add(began - *began_);
  began_ = began;
  publish();
}

void Cycle::run() noexcept {
  const RealTimeGrant of_process = granted_;
  granted_ = become_real_time(real_time_);
  granted_.memory_locked = of_process.memory_locked;
  granted_.processors_awake = of_process.processors_awake;
  grid_.restart(clock_.now() + period_);
  while (!ending_.load(std::memory_order_relaxed)) timed_step();
  ended_.store(true, std::memory_order_release);
}

void Cycle::begin() {
  if (!clock_.real_time() || thread_.joinable() || ending_.load(std::memory_order_relaxed)) return;
  times_.emplace();
  if (real_time_.lock_memory) granted_.memory_locked = memory_.emplace().locked();
  granted_.processors_awake = awake_.emplace().held();
  silence_.restart(clock_.now());
  thread_ = std::thread([this] { run(); });
}

void Cycle::turn() noexcept {
  if (!thread_.joinable()) {
    step();
    return;
  }
  do watch();
  while (cycles() == 0 && !hangs());
}

void Cycle::watch() noexcept {
  clock_.sleep_until(clock_.now() + period_);
  silence_.look(clock_.now(), cycles());
  if (hangs()) executive_.stop_past_cycle();
}

bool Cycle::any_left_behind() noexcept { return left_behind.load(); }

bool Cycle::end() noexcept {
  ending_.store(true, std::memory_order_relaxed);
  if (!thread_.joinable()) return true;
  while (!ended_.load(std::memory_order_acquire) && !given_up()) watch();
  if (!ended_.load(std::memory_order_acquire)) {
    left_behind = true;
    ending_.store(false, std::memory_order_relaxed);
    return false;
  }
  thread_.join();
  times_->cycles = cycles();
  times_->overruns = overruns();
  times_->missed_cycles = missed_cycles();
  memory_.reset();
  awake_.reset();
  return true;
}

}  // namespace tankrig
