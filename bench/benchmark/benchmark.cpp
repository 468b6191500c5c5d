#include "bench/benchmark/benchmark.hpp"

#include <algorithm>
#include <cmath>

#include "core/text_files.hpp"

namespace tankrig {

const char* Updater::column() const {
  switch (kind) {
    case UpdaterKind::kNone:
      return "none";
    case UpdaterKind::kFog:
    case UpdaterKind::kBagFog:
      return "Fog";
    case UpdaterKind::kCurrent:
      return "Current";
    case UpdaterKind::kArmMove:
      return "ArmMove";
    case UpdaterKind::kRepeat:
      return "Iteration";
    case UpdaterKind::kLight:
      return "Light";
    case UpdaterKind::kNoise:
      return "Noise";
    case UpdaterKind::kParticles:
      return "Particles";
    case UpdaterKind::kSweepSpeed:
      return "SweepSpeed";
    case UpdaterKind::kAlgorithm:
      return "Algorithm";
    case UpdaterKind::kCalibrationError:
      return "CalibrationError";
    case UpdaterKind::kLux:
      return "Lux";
  }
  return "";
}

std::size_t Updater::count() const {
  if (!levels.empty()) return levels.size();
  return static_cast<std::size_t>(std::floor((last - first) / step + 5e-7)) + 1;
}

/// From a whole number of millionths, so that 3 * 0.05 is the number that 0.15 reads as.
double Updater::value(std::size_t index) const {
  if (!levels.empty()) return levels.at(index);
  return std::round((first + static_cast<double>(index) * step) * 1e6) / 1e6;
}

double Updater::highest() const { return levels.empty() ? value(count() - 1) : std::ranges::max(levels); }

std::string Updater::shown(double value) const {
  return kind == UpdaterKind::kAlgorithm ? clouds.at(static_cast<std::size_t>(value)) : exact_text(value);
}

std::size_t Benchmark::points() const {
  std::size_t product = 1;
  for (const Updater& updater : updaters) product *= updater.count();
  return product;
}

std::vector<double> Benchmark::values(std::size_t point) const {
  std::vector<double> out(updaters.size());
  for (std::size_t i = updaters.size(); i-- > 0;) {
    out[i] = updaters[i].value(point % updaters[i].count());
    point /= updaters[i].count();
  }
  return out;
}

}  // namespace tankrig
