// `tankrig doctor`: what this machine can and cannot do for a rig.
#pragma once

#include <filesystem>
#include <string>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

struct DoctorOptions {
  std::string rig = "tank-sim";
  double seconds = 5;                           ///< of the latency test
  std::filesystem::path sessions = "sessions";  ///< where scans would be recorded
  bool json = false;
};
void add_doctor(CLI::App& app, ChosenCommand& chosen);

/// kOk: all is well; kPartial: something is to be mended; kFailure: this machine cannot run this rig.
int doctor(const DoctorOptions& options);

}  // namespace tankrig::app
