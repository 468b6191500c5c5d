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
  LightOperator(const RigConfig& rig, const ScanOptions& options, Progress& progress);

  /// Errors: InputError, if a level is more than the scene's brightest light gives.
  void check(const LuxLevel& level) const;
  /// Sets the level and returns how it is scanned. A person is asked for it and the lux meter read until it is there; on
  /// a rig without one the person types the reading in. Nothing if a stop was asked for first.
  /// Errors: InputError of the lux meter's driver, or without meter and terminal.
  std::optional<ScanOptions> set(const LuxLevel& level) const;

 private:
  std::optional<ScanOptions> asked(const LuxLevel& level) const;
  ScanOptions typed(const LuxLevel& level) const;

  const RigConfig& rig_;
  const ScanOptions& options_;
  Progress& progress_;
  std::optional<double> most_lux_;  ///< at light 1, of a simulated tank
};

}  // namespace tankrig::app
