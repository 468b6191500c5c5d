#include "bench/sweep/sweep_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr ShownFigure kShown[] = {{"coverage", "coverage of the surface [%]", 100, 1},
                                  {"outliers", "outliers [%]", 100, 2},
                                  {"mean_error", "mean error [mm]", 1000, 3},
                                  {"stddev", "standard deviation [mm]", 1000, 3},
                                  {"of_ceiling", "coverage of what can be seen [%]", 100, 1}};

constexpr std::size_t kMostViewed = 256;

/// Where a configuration is in the loops that are drawn.
struct Dot {
  std::size_t x = 0, curve = 0, dots = 1;
  std::size_t xs = 1;            ///< number of values of x
  std::size_t standing_for = 0;  ///< configuration
};

Dot dot_of(const Benchmark& benchmark, std::size_t point) {
  const SweepAxes axes(benchmark);
  Dot dot;
  std::size_t step = 1;  // from one value of the loop to the next
  for (std::size_t i = benchmark.updaters.size(); i-- > 0;) {
    const std::size_t count = benchmark.updaters[i].count(), index = point % count;
    const auto loop = static_cast<int>(i);
    if (loop == axes.x) dot.x = index, dot.xs = count;
    if (loop == axes.curve) dot.curve = index;
    if (loop == axes.x || loop == axes.curve) dot.standing_for += index * step, dot.dots *= count;
    point /= count, step *= count;
  }
  return dot;
}

}  // namespace

std::span<const ShownFigure> shown_figures() { return kShown; }

const ShownFigure& shown_figure_of(const std::string& detail) {
  return *std::ranges::find_if(kShown, [&](const ShownFigure& figure) { return detail == figure.detail; });
}

std::string number_text(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

SweepAxes::SweepAxes(const Benchmark& benchmark) {
  const auto find = [&](UpdaterKind kind) {
    for (std::size_t i = 0; i < benchmark.updaters.size(); ++i)
      if (benchmark.updaters[i].kind == kind) return static_cast<int>(i);
    return -1;
  };
  const auto innermost_but = [&](int taken, bool curves) {
    for (int i = static_cast<int>(benchmark.updaters.size()) - 1; i >= 0; --i)
      if (i != taken && benchmark.updaters[static_cast<std::size_t>(i)].kind != UpdaterKind::kRepeat &&
          (curves || benchmark.updaters[static_cast<std::size_t>(i)].kind != UpdaterKind::kAlgorithm))
        return i;
    return -1;
  };
  curve = find(UpdaterKind::kNoise);
  x = find(UpdaterKind::kLight);
  if (x < 0) x = innermost_but(curve, false);
  if (curve < 0) curve = innermost_but(x, true);
}

bool SweepAxes::are_papers(const Benchmark& benchmark) const {
  const auto is = [&](int loop, UpdaterKind kind) {
    return loop >= 0 && benchmark.updaters[static_cast<std::size_t>(loop)].kind == kind;
  };
  return is(x, UpdaterKind::kLight) && is(curve, UpdaterKind::kNoise);
}

std::string level_text(const Updater& updater, double value) {
  return updater.kind == UpdaterKind::kAlgorithm ? updater.shown(value) : fmt::format("{:g}", value);
}

const char* axis_label(const Updater& updater) {
  switch (updater.kind) {
    case UpdaterKind::kLight:
      return "ambient light [share of the reference]";
    case UpdaterKind::kNoise:
      return "noise [share of full scale]";
    case UpdaterKind::kFog:
      return "added attenuation [1/m]";
    case UpdaterKind::kBagFog:
      return "fog added to the pictures [1/m]";
    case UpdaterKind::kArmMove:
      return "posture [ways from one to the next]";
    case UpdaterKind::kCurrent:
      return "current [m/s]";
    case UpdaterKind::kParticles:
      return "particles [1/m3]";
    case UpdaterKind::kSweepSpeed:
      return "sweep [rad/s]";
    case UpdaterKind::kAlgorithm:
      return "algorithm";
    case UpdaterKind::kCalibrationError:
      return updater.error.turns ? "error of the calibration [rad]" : "error of the calibration [m]";
    case UpdaterKind::kLux:
      return "light at the lux meter [lx]";
    default:
      return "iteration";
  }
}

Spread spread_of(const std::vector<double>& values) {
  Spread s;
  s.n = values.size();
  if (values.empty()) return s;
  for (const double v : values) s.mean += v / static_cast<double>(s.n);
  for (const double v : values) s.sd += (v - s.mean) * (v - s.mean);
  s.sd = s.n > 1 ? std::sqrt(s.sd / static_cast<double>(s.n - 1)) : 0;
  s.low = *std::min_element(values.begin(), values.end());
  s.high = *std::max_element(values.begin(), values.end());
  return s;
}

std::vector<const Measure*> clouds_of(const Benchmark& benchmark) {
  std::vector<const Measure*> out;
  for (const Measure& measure : benchmark.measures)
    if (measure.kind == MeasureKind::kReconstruction3D && measure.arithmetic == Arithmetic::kPaper)
      out.push_back(&measure);
  return out;
}

std::size_t standing_for(const Benchmark& benchmark, std::size_t point) {
  return dot_of(benchmark, point).standing_for;
}

bool is_viewed(const Benchmark& benchmark, std::size_t point) {
  const Dot dot = dot_of(benchmark, point);
  const std::size_t every = (dot.dots + kMostViewed - 1) / kMostViewed;
  return dot.standing_for == point && (dot.curve * dot.xs + dot.x) % every == 0;
}

}  // namespace tankrig
