// Who sets the light between the recordings of an experiment: a person, or, at a simulated tank, the program.
#pragma once

#include <optional>

#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/scan/record_session.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/scan/lux_level.hpp"

namespace tankrig::app {

class LightOperator {
 public:
  LightOperator(const RigConfig& rig, sim::WorldOptions world, Progress& progress);

  /// Errors: InputError, if a level is more than the scene's brightest light gives.
  void check(const LuxLevel& level) const;
  /// Sets the level, and in `scan` how it is recorded. A person is asked for it and the lux meter read until it is there;
  /// on a rig without one the person types the reading in.
  /// Errors: StoppedEarly; InputError of the lux meter's driver, or without meter and terminal.
  void set(const LuxLevel& level, ScanOptions& scan) const;

 private:
  void wait_for_meter(const LuxLevel& level, const std::string& command) const;
  /// A reading that holds the level.
  std::string typed(const LuxLevel& level) const;

  const RigConfig& rig_;
  Progress& progress_;
  std::optional<double> most_lux_;  ///< at light 1, of a simulated tank
};

}  // namespace tankrig::app
