// What a sweep's tables, curves and pages share: which figures are shown and how, which loop is which axis.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/benchmark/benchmark.hpp"

namespace tankrig {

/// A detail of reconstruction3D as people read it: shares in per cent, metres in millimetres.
struct ShownFigure {
  const char *detail, *label;
  double factor;
  int digits;
};
std::span<const ShownFigure> shown_figures();
const ShownFigure& shown_figure_of(const std::string& detail);
std::string number_text(double value, int digits);

/// Which loops are drawn as what; -1: none is.
struct SweepAxes {
  int x = -1, curve = -1;

  explicit SweepAxes(const Benchmark& benchmark);
  /// Light over noise, as in the paper's figures.
  bool are_papers(const Benchmark& benchmark) const;
};

const char* axis_label(const Updater& updater);
/// "0.05", or the algorithm's name.
std::string level_text(const Updater& updater, double value);

/// The reconstruction3D measures with the paper's definition.
std::vector<const Measure*> clouds_of(const Benchmark& benchmark);

/// The configuration that stands for a dot of a curve, whose frames and clouds are kept to be looked at: where `point` is in
/// the two loops that are drawn, and at the first value of all others.
std::size_t standing_for(const Benchmark& benchmark, std::size_t point);
/// Whether `point` is such a one; of many, evenly thinned to at most 256.
bool is_viewed(const Benchmark& benchmark, std::size_t point);

struct Spread {
  double mean = 0, sd = 0, low = 0, high = 0;
  std::size_t n = 0;
};
Spread spread_of(const std::vector<double>& values);

}  // namespace tankrig
