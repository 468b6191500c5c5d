#include "sim_backends/mock/mock_laser.hpp"

#include <algorithm>

namespace tankrig::sim {

Status MockLaser::set(bool on) noexcept {
  const bool now_on = count_ > 0 && edge(0).on;
  if (on != now_on) edges_[count_++ % kEdges] = {clock_.now(), on};
  return {};
}

Result<LaserState> MockLaser::state() noexcept {
  LaserState s;
  if (count_ == 0) return s;
  const Edge& last = edge(0);
  s.commanded = s.powered = last.on;
  s.emitting = power_at(clock_.now()) > 0;
  s.since = s.emitting ? last.when + warm_up_ : last.when;
  return s;
}

double MockLaser::power_at(Stamp when) const noexcept {
  const std::size_t known = std::min(count_, kEdges);
  for (std::size_t back = 0; back < known; ++back)
    if (edge(back).when <= when) return edge(back).on && edge(back).when + warm_up_ <= when ? 1 : 0;
  return 0;
}

}  // namespace tankrig::sim
