// Listens to each cycle while it runs.
#pragma once

#include "rig/executive/cycle_record.hpp"

namespace tankrig {

/// Threads: called in the cycle's, with the record of the cycle before it leaves.
/// RT: must be safe.
class CycleListener {
 public:
  virtual ~CycleListener() = default;
  virtual void cycle(const CycleRecord& record) noexcept = 0;
};

}  // namespace tankrig
