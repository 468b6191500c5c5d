// Nothing moves or shines unexpectedly: what will is said, asked for once, and warned of for a while.
#pragma once

#include <string>

#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// "its arm will move for 62 s (elbow 51.6 to 120.3 deg), and its laser will shine for 18 s": of what moves at all.
std::string what_will_happen(const ScanPlan& plan);

/// While it lives, the rig's lamp or sounder is on. Construction asks, then counts `safety: start_warning_s` down. A
/// simulated or emulated rig hurts nobody: nobody is asked, and there is no warning unless the rig file has one.
class StartWarning {
 public:
  /// `what`: "its arm will ...". `yes`: answered already.
  /// Errors: InputError if the answer is not yes, there is no terminal to ask on, or the lamp does not take its
  /// command; StoppedEarly.
  StartWarning(const RigConfig& rig, Backend& backend, const std::string& what, bool yes, Progress& progress);
  ~StartWarning();
  StartWarning(const StartWarning&) = delete;
  StartWarning& operator=(const StartWarning&) = delete;

 private:
  WarningLine* lamp_;
};

}  // namespace tankrig::app
