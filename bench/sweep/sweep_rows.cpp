#include "bench/sweep/sweep_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/benchmark/point_store.hpp"

using nlohmann::ordered_json;

namespace tankrig {
namespace {

constexpr std::size_t kMostFailures = 50;  ///< with their texts; results.csv has all
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kPerFigure = 3;

std::optional<double> known(double number) { return std::isnan(number) ? std::nullopt : std::optional(number); }

double number_of(const ordered_json& in, const char* key) {
  const auto found = in.find(key);
  return found != in.end() && found->is_number() ? found->get<double>() : kNone;
}

}  // namespace

SweepRows::SweepRows(const Benchmark& benchmark, std::size_t expected) : loops_(benchmark.updaters.size()) {
  for (const Measure* measure : clouds_of(benchmark)) clouds_.push_back(measure->name);
  stride_ = loops_ + clouds_.size() * shown_figures().size() * kPerFigure;
  points_.reserve(expected);
  numbers_.reserve(expected * stride_);
}

void SweepRows::add(std::size_t point, const ordered_json& row) {
  points_.push_back(point);
  for (std::size_t i = 0; i < loops_; ++i) numbers_.push_back(row["values"][i].get<double>());
  const ordered_json none = ordered_json::object();
  const auto part = [&](const ordered_json& whole, const std::string& key) -> const ordered_json& {
    const auto found = whole.find(key);
    return found == whole.end() ? none : *found;
  };
  for (const std::string& cloud : clouds_) {
    const ordered_json& values = part(part(row, "measures"), cloud);
    for (const ShownFigure& figure : shown_figures()) {
      numbers_.push_back(number_of(values, figure.detail));
      const ordered_json& interval = part(part(values, "interval95"), figure.detail);
      const bool there =
          interval.is_array() && interval.size() == 2 && interval[0].is_number() && interval[1].is_number();
      for (std::size_t end = 0; end < 2; ++end) numbers_.push_back(there ? interval[end].get<double>() : kNone);
    }
  }
  if (std::string error = point_error(row); !error.empty()) {
    ++failed_;
    if (failures_.size() < kMostFailures) failures_.push_back({point, std::move(error)});
  }
  const std::string session = row.value("session", "");
  if (session.empty() || (!recordings_.empty() && recordings_.back().session == session)) return;
  recordings_.push_back({point, session, row.value("recorded_utc", ""), row.value("warning", ""),
                         known(number_of(row, "lux")), known(number_of(row, "lux_uncertainty"))});
}

const double& SweepRows::number(std::size_t i, std::size_t cloud, const ShownFigure& figure) const {
  const auto column = static_cast<std::size_t>(&figure - shown_figures().data());
  return numbers_[i * stride_ + loops_ + (cloud * shown_figures().size() + column) * kPerFigure];
}

std::optional<double> SweepRows::value(std::size_t i, std::size_t cloud, const ShownFigure& figure) const {
  return known(number(i, cloud, figure));
}

std::optional<std::array<double, 2>> SweepRows::interval(std::size_t i, std::size_t cloud,
                                                         const ShownFigure& figure) const {
  const double* const ends = &number(i, cloud, figure) + 1;
  if (std::isnan(ends[0]) || std::isnan(ends[1])) return std::nullopt;
  return std::array{ends[0], ends[1]};
}

std::optional<std::size_t> SweepRows::place(std::size_t point) const {
  const auto found = std::ranges::lower_bound(points_, point);
  if (found == points_.end() || *found != point) return std::nullopt;
  return static_cast<std::size_t>(found - points_.begin());
}

}  // namespace tankrig
