#include "apps/tankrig/bench/condition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tankrig::app {
namespace {

/// First to last posture, `value` ways along.
JointVector between(const std::vector<std::vector<double>>& postures, double value) {
  const auto from = std::min(static_cast<std::size_t>(value), postures.size() - 1);
  const std::size_t to = std::min(from + 1, postures.size() - 1);
  const double share = value - static_cast<double>(from);
  JointVector q;
  for (int j = 0; j < kJoints; ++j) q[j] = (1 - share) * postures[from][j] + share * postures[to][j];
  return q;
}

}  // namespace

std::string Condition::scan_key() const {
  std::string key = fmt::format("seed {}", world.seed);
  if (world.particles_per_m3) key += fmt::format(" particles {}", *world.particles_per_m3);
  if (world.turbidity) key += fmt::format(" turbidity {}", *world.turbidity);
  if (world.particle_drift) {
    const Vector3d& v = *world.particle_drift;
    key += fmt::format(" drift {} {} {}", v.x(), v.y(), v.z());
  }
  if (sweep_velocity) key += fmt::format(" sweep {}", *sweep_velocity);
  if (posture) {
    key += " posture";
    for (const double q : *posture) key += fmt::format(" {}", q);
  }
  return key;
}

Condition condition_at(const Benchmark& benchmark, std::size_t point, const BenchmarkNames& names,
                       const sim::WorldOptions& world) {
  Condition out;
  out.world = world;
  const std::vector<double> values = benchmark.values(point);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Updater& updater = benchmark.updaters[i];
    const double value = values[i];
    switch (updater.kind) {
      case UpdaterKind::kLight:
        out.pictures.light = value;
        break;
      case UpdaterKind::kNoise:
        out.pictures.noise = value;
        break;
      case UpdaterKind::kRepeat:
        out.world.seed += static_cast<std::uint64_t>(value);
        break;
      case UpdaterKind::kFog:
        out.world.turbidity = value;
        break;
      case UpdaterKind::kParticles:
        out.world.particles_per_m3 = value;
        break;
      case UpdaterKind::kCurrent: {
        const CurrentSwing& c = updater.current;
        out.world.particle_drift = value * Vector3d(std::sin(c.theta) * std::cos(c.phi),
                                                    std::sin(c.theta) * std::sin(c.phi), std::cos(c.theta));
        break;
      }
      case UpdaterKind::kSweepSpeed:
        out.sweep_velocity = value;
        break;
      case UpdaterKind::kArmMove:
        out.posture = between(updater.arm_positions, value);
        break;
      case UpdaterKind::kAlgorithm:
        out.cloud = names.of(updater.clouds.at(static_cast<std::size_t>(value)));
        break;
      case UpdaterKind::kCalibrationError:
        out.errors.push_back({names.of(updater.target), updater.error, value});
        break;
      case UpdaterKind::kLux:
        out.pictures.lux = value;
        break;
      case UpdaterKind::kBagFog:
        out.pictures.fog = {value, updater.image_depth_m};
        break;
      case UpdaterKind::kNone:
        break;
    }
  }
  return out;
}

}  // namespace tankrig::app
