// The line projector of the simulated rig: a relay, a warm-up, and a memory of when it shone.
#pragma once

#include <array>
#include <atomic>
#include <mutex>

#include "core/clock.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig::sim {

/// Its possible faults, for tests; set by the thread that owns the laser.
struct MockLaserFaults {
  bool stuck_on = false;   ///< the relay has welded: off() succeeds and changes nothing
  bool dead = false;       ///< powered, but never emits
  bool set_fails = false;  ///< on() and off() are refused with kIo and change nothing
};

/// Faults of the light itself, beside relay and read-back.
enum class MockBeam : std::uint8_t { kTrue, kDark, kStuck };

/// Threads: any; a mutex guards the memory.
/// RT: no allocation; blocks only while another thread is inside.
class MockLaser final : public Laser {
 public:
  MockLaser(Duration warm_up, const Clock& clock) : warm_up_(warm_up), clock_(clock) {}

  void last_resort() noexcept override {}  ///< its light dies with the process
  Result<LaserState> state() noexcept override;
  Duration warm_up() const noexcept override { return warm_up_; }

  MockLaserFaults faults;
  /// Affects power_at() from now on; state() does not know.
  void set_beam(MockBeam beam) noexcept { beam_.store(beam, std::memory_order_relaxed); }

  /// Emitted power at `when`, 0 or 1 of the projector's. Remembers the last kEdges switchings.
  double power_at(Stamp when) const noexcept;

 private:
  friend class RelayEmulator;  // whose relay feeds it
  Status set(bool on) noexcept override;

  static constexpr std::size_t kEdges = 256;
  struct Edge {
    Stamp when{};
    bool on = false;
  };
  double power(Stamp when) const noexcept;
  const Edge& edge(std::size_t back) const noexcept { return edges_[(count_ - 1 - back) % kEdges]; }

  Duration warm_up_;
  const Clock& clock_;
  std::atomic<MockBeam> beam_{MockBeam::kTrue};
  mutable std::mutex mutex_;  // guards what follows
  bool commanded_ = false;
  std::array<Edge, kEdges> edges_{};
  std::size_t count_ = 0;
};

}  // namespace tankrig::sim
