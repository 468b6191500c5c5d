// Who else hears of a cycle while it is made.
#pragma once

#include "rig/executive/cycle_record.hpp"

namespace tankrig {

/// Threads: called in the cycle's, with the record it is about to leave.
/// RT: must be safe.
class CycleListener {
 public:
  virtual ~CycleListener() = default;
  virtual void cycle(const CycleRecord& record) noexcept = 0;
};

}  // namespace tankrig
