// What curves, tables and pages show of a sweep's configurations: half a kilobyte of numbers for each, of which a sweep may
// have a million.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/sweep/sweep_values.hpp"

namespace tankrig {

class SweepRows {
 public:
  struct Failure {
    std::size_t point;
    std::string error;
  };
  /// A recording of an experiment, with the first configuration that is measured on it.
  struct Recording {
    std::size_t point;
    std::string session, recorded_utc, warning;
    std::optional<double> lux, lux_uncertainty;
  };

  /// `expected`: about so many are added.
  explicit SweepRows(const Benchmark& benchmark, std::size_t expected = 0);

  /// By rising number.
  void add(std::size_t point, const nlohmann::ordered_json& row);

  // By place, 0 to size() - 1.
  std::size_t size() const { return points_.size(); }
  std::size_t point(std::size_t i) const { return points_[i]; }
  /// The values of the loops.
  std::span<const double> loops(std::size_t i) const { return {&numbers_[i * stride_], loops_}; }
  /// Of the measure `cloud` of clouds_of(), as the row has it.
  std::optional<double> value(std::size_t i, std::size_t cloud, const ShownFigure& figure) const;
  std::optional<std::array<double, 2>> interval(std::size_t i, std::size_t cloud, const ShownFigure& figure) const;
  /// The place of a configuration, if it is there.
  std::optional<std::size_t> place(std::size_t point) const;

  std::size_t failed() const { return failed_; }                      ///< configurations in which something failed
  const std::vector<Failure>& failures() const { return failures_; }  ///< the first of them
  const std::vector<Recording>& recordings() const { return recordings_; }

 private:
  const double& number(std::size_t i, std::size_t cloud, const ShownFigure& figure) const;

  std::vector<std::string> clouds_;  ///< names of measures
  std::size_t loops_, stride_;
  std::vector<std::size_t> points_;
  std::vector<double> numbers_;  ///< per configuration: its loops, then value and interval of each figure; NaN: none
  std::size_t failed_ = 0;
  std::vector<Failure> failures_;
  std::vector<Recording> recordings_;
};

}  // namespace tankrig
