// One configuration of a benchmark, as the rig takes it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/bench/calibration_error.hpp"
#include "bench/benchmark/benchmark.hpp"
#include "bench/benchmark/run_trace.hpp"
#include "core/arm_model.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// Between the cameras and what they saw, everywhere as thick: exp(-1.442695 (density * distance)^2) of it is left.
struct Fog {
  double density = 0;  ///< [1/m]
  double distance_m = 0;
};

/// What the camera pictures of one configuration are made with; absent: the scene's own.
struct PictureConditions {
  std::optional<double> light, noise;
  std::optional<double> lux;  ///< in place of light: what the lux meter reads
  std::optional<Fog> fog;     ///< added to recorded pictures
};

struct Condition {
  sim::WorldOptions world;               ///< of the scan
  std::optional<double> sweep_velocity;  ///< [rad/s]
  std::optional<JointVector> posture;    ///< of the joints that do not sweep [rad]
  std::string cloud;                     ///< that an algorithmUpdater has chosen
  std::vector<CalibrationError> errors;
  PictureConditions pictures;

  /// Conditions with the same key share a scan.
  std::string scan_key() const;
};

/// `world`: what the loops do not change.
Condition condition_at(const Benchmark& benchmark, std::size_t point, const BenchmarkNames& names,
                       const sim::WorldOptions& world);

}  // namespace tankrig::app
