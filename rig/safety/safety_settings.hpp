// How strictly laser and arm are watched: the rig file's `scan: safety:` section as plain numbers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/watchdog/warning_line.hpp"
#include "drivers/watchdog/watchdog_settings.hpp"

namespace tankrig {

/// Whether cameras testify to the beam, and how soon a contradiction is a fault.
struct BeamSettings {
  bool verify = true;   ///< compares what cameras see with what the laser's device says
  int frames = 5;       ///< so many frames of one camera in a row that contradict the laser are a fault
  int dark_frames = 4;  ///< dark frames of a camera before the first light, to learn from; at most the scan's own
  std::vector<std::string> waived;  ///< cameras that do not testify
};

/// Units: seconds, rad/s.
struct SafetySettings {
  double indicator_delay = 1.0;      ///< from arming to the first light, at least: people see that the laser is armed
  double maximum_on = 180;           ///< longest stretch of light; it ends when it has been dark for indicator_delay
  double hold_limit = 150;           ///< longest light with the arm at rest, for one request
  double laser_off_allowance = 0.1;  ///< longest the laser may stay powered or lit when it is not commanded
  double laser_on_margin = 0.25;     ///< longest it may stay dark beyond its warm-up when it is commanded
  double rest_velocity = 0.01;       ///< measured joint velocity below which a joint is at rest
  double rest_timeout = 3.0;         ///< after the end, longest wait for laser dark and arm at rest
  double camera_timeout = 1.0;       ///< longest silence of a camera that has begun to deliver
  double guardian_timeout = 0.06;    ///< longest time between two safety steps; then the guardian makes safe
  BeamSettings beam;
  HeartbeatOutput heartbeat_output;
  EnableInput enable_input;
  std::optional<double> start_warning{};  ///< before a start; nothing: 3 on a rig with devices, 0 on a simulated one
  WarningOutput warning_output;
  /// A start needs a passed start-up test that is no older; nothing: 24 on a rig with devices, none on a simulated one.
  std::optional<double> commissioned_within_h{};
};

}  // namespace tankrig
