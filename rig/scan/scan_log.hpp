// The scan's events for its session: phases, laser, faults, and how it ended.
#pragma once

#include <string>

#include "rig/capture/scan_sink.hpp"
#include "rig/executive/cycle_record.hpp"
#include "rig/executive/safe_end.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// Turns changes between cycle records into events.
/// Threads: one.
/// RT: never.
class ScanLog {
 public:
  ScanLog(const ScanPlan& plan, ScanSink& sink) : plan_(plan), sink_(sink) {}

  /// Records in order of their stamps. `why`: the supervisor's reason for a stop, or for a fault reported to it or by a
  /// thread; empty if a user asked for the stop.
  void add(const CycleRecord& record, const std::string& why);
  void summary(Stamp now, double max_following_error, Duration worst_residual, const EndState& left);

  /// The latched fault in words, after the stop that preceded it; empty if there is none.
  std::string fault() const { return stop_.empty() || fault_.empty() ? fault_ : stop_ + "; " + fault_; }

 private:
  void failed(const char* what, Stamp when, const Status& now, const Status& before);

  const ScanPlan& plan_;
  ScanSink& sink_;
  CycleRecord last_;
  bool emitting_ = false;  // as the laser last reported
  std::string stop_, fault_;
};

}  // namespace tankrig
