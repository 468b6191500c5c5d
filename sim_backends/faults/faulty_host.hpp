// Faults beside the devices: the interlock's loop, the disk, and the loop that supervises the cycle.
#pragma once

#include "core/clock.hpp"
#include "sim_backends/faults/fault_script.hpp"

namespace tankrig::sim {

/// Threads: one, the supervisor's.
/// RT: never.
class FaultyHost {
 public:
  /// Both outlive it.
  FaultyHost(FaultScript& script, Clock& clock) : script_(script), clock_(clock) {}

  /// The loop's reading when it really is `closed`.
  bool interlock(bool closed) const noexcept;
  /// Call before every write to the session; that of a frame may take its time.
  /// Errors: InputError: disk full, I/O error.
  void write(bool frame);
  /// Call once per round of the supervising loop; may take its time.
  /// Errors: std::runtime_error if the loop dies.
  void round();

 private:
  const FaultSpec* active(FaultDevice device, FaultKind kind) const noexcept {
    return script_.active(device, kind, clock_.now());
  }

  FaultScript& script_;
  Clock& clock_;
};

}  // namespace tankrig::sim
