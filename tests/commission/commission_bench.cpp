#include "tests/commission/commission_bench.hpp"

namespace tankrig::testing_support {

Result<LaserState> ProofLaser::state() noexcept {
  const std::lock_guard lock(mutex_);
  auto state = behind_.state();
  if (!state.ok() || !state.value().commanded || !withheld_since_ || !watchdog) return state;
  const Duration silent = clock_.now() - *withheld_since_;
  if (silent < *watchdog) return state;
  if (!opened_) opened_ = silent;
  LaserState open = state.value();
  open.powered = open.emitting = false;
  return open;
}

std::optional<Duration> ProofLaser::opened_by_itself() const noexcept {
  const std::lock_guard lock(mutex_);
  return opened_;
}

void ProofLaser::withhold_refreshes(bool withheld) noexcept {
  const std::lock_guard lock(mutex_);
  if (withheld) opened_.reset();
  withheld_since_ = withheld ? std::optional(clock_.now()) : std::nullopt;
}

}  // namespace tankrig::testing_support
