// The fault plan of a simulated rig, as a scan meets it: what concerns disk, supervisor and interlock, and the
// session's record of it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/tankrig/devices/backend.hpp"
#include "session/recording/event_kinds.hpp"
#include "session/recording/session_writer.hpp"
#include "sim_backends/faults/faulty_host.hpp"

namespace tankrig::app {

/// Nothing at all on a backend without a plan.
/// Threads: one, the supervisor's.
class PlayedFaults {
 public:
  /// `file`: the plan; empty: none. One that is played on emulated devices is only kept.
  PlayedFaults(Backend& backend, SessionWriter& writer, const std::filesystem::path& file)
      : backend_(backend), writer_(writer), script_(backend.faults()) {
    if (!script_ && !file.empty()) writer.add_text("faults.yaml", sim::FaultPlan::load(file).yaml());
    if (!script_) return;
    host_.emplace(*script_, backend.clock());
    writer.add_text("faults.yaml", script_->plan().yaml());
  }

  /// Before every write.
  /// Errors: FaultyHost::write's.
  void write(bool frame) {
    if (host_) host_->write(frame);
  }
  void enter_phase(std::string_view name, Stamp when) {
    if (script_) script_->enter_phase(name, when);
  }
  /// Once in every round: tells what has begun or ended, and how the interlock reads.
  bool round() {
    if (!host_) return backend_.interlock_closed();
    for (const sim::FaultEvent& e : script_->news(backend_.clock().now()))
      writer_.event(e.when, event_kind::kInjected, e.text);
    host_->round();
    return host_->interlock(backend_.interlock_closed());
  }
  /// After the scan: a phase that never came, a time beyond the end.
  std::vector<std::string> never_began() const {
    return script_ ? script_->waiting(backend_.clock().now()) : std::vector<std::string>{};
  }

 private:
  Backend& backend_;
  SessionWriter& writer_;
  sim::FaultScript* script_;
  std::optional<sim::FaultyHost> host_;
};

}  // namespace tankrig::app
