// The line projector of the simulated rig: a relay, a warm-up, and a memory of when it shone.
#pragma once

#include <array>

#include "core/clock.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig::sim {

/// Threads: one.
class MockLaser final : public Laser {
 public:
  MockLaser(Duration warm_up, const Clock& clock) : warm_up_(warm_up), clock_(clock) {}

  Status set(bool on) noexcept override;
  Result<LaserState> state() noexcept override;
  Duration warm_up() const noexcept override { return warm_up_; }

  /// Emitted power at `when`, 0 or 1 of the projector's. Remembers the last kEdges switchings.
  double power_at(Stamp when) const noexcept;

 private:
  static constexpr std::size_t kEdges = 256;
  struct Edge {
    Stamp when{};
    bool on = false;
  };
  const Edge& edge(std::size_t back) const noexcept { return edges_[(count_ - 1 - back) % kEdges]; }

  Duration warm_up_;
  const Clock& clock_;
  std::array<Edge, kEdges> edges_{};
  std::size_t count_ = 0;
};

}  // namespace tankrig::sim
