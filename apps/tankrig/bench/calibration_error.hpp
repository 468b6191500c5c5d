// What a calibrationErrorUpdater makes wrong in what a session says of its rig.
#pragma once

#include <string>

#include "bench/benchmark/benchmark.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

struct CalibrationError {
  std::string target;  ///< "laser", or a camera's name
  PoseError pose;
  double value = 0;  ///< [m] or [rad]
};

/// Whether there is such a target.
bool has_target(const SessionInfo& info, const std::string& target);

/// Moves a camera in its own frame, or the laser's plane in that of the end effector, about the laser's exit. Pictures
/// and joints stay, so that what is made of them is wrong.
void put_error(const CalibrationError& error, SessionInfo& info);

}  // namespace tankrig::app
