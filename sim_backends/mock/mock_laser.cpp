#include "sim_backends/mock/mock_laser.hpp"

#include <algorithm>

namespace tankrig::sim {

Status MockLaser::set(bool on) noexcept {
  const std::lock_guard lock(mutex_);
  if (faults.set_fails) return Error{ErrorCode::kIo, 0, clock_.now(), "laser: switch"};
  commanded_ = on;
  const bool powered = count_ > 0 && edge(0).on;
  const bool welded = powered && faults.stuck_on;
  if (on != powered && !welded) edges_[count_++ % kEdges] = {clock_.now(), on};
  return {};
}

Result<LaserState> MockLaser::state() noexcept {
  const std::lock_guard lock(mutex_);
  LaserState s;
  s.commanded = commanded_;
  if (count_ == 0) return s;
  const Edge& last = edge(0);
  s.powered = last.on;
  s.emitting = power(clock_.now()) > 0;
  s.since = s.emitting ? last.when + warm_up_ : last.when;
  return s;
}

double MockLaser::power_at(Stamp when) const noexcept {
  if (const MockBeam beam = beam_.load(std::memory_order_relaxed); beam != MockBeam::kTrue)
    return beam == MockBeam::kStuck ? 1 : 0;
  const std::lock_guard lock(mutex_);
  return power(when);
}

double MockLaser::power(Stamp when) const noexcept {
  if (faults.dead) return 0;
  const std::size_t known = std::min(count_, kEdges);
  for (std::size_t back = 0; back < known; ++back)
    if (edge(back).when <= when) return edge(back).on && edge(back).when + warm_up_ <= when ? 1 : 0;
  return 0;
}

}  // namespace tankrig::sim
