// `tankrig calibrate`: what a recorded session tells about the rig itself.
#pragma once

#include <filesystem>
#include <vector>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

struct CalibrateTimeOptions {
  std::vector<std::filesystem::path> sessions;  ///< of one rig; of different speed to tell backlash from time
  bool json = false;
};

/// Defines `tankrig calibrate` and what is below it.
void add_calibrate(CLI::App& app, ChosenCommand& chosen);

/// The camera's time offset from a sweep there and back; writes results/time_offset.yaml into every session.
/// Errors: InputError, of a session without passes in both directions too.
int calibrate_time(const CalibrateTimeOptions& options);

}  // namespace tankrig::app
