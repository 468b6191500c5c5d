#include "bench/sweep/sweep_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <span>

#include "bench/sweep/sweep_values.hpp"

namespace tankrig {
namespace {

using Loops = std::span<const double>;  ///< the values of a configuration's loops

/// Values of a figure at the configurations for which `wanted` holds.
template <class Wanted>
std::vector<double> values_where(const SweepRows& rows, std::size_t cloud, const ShownFigure& figure, Wanted wanted) {
  std::vector<double> out;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (wanted(rows.loops(i)))
      if (const auto value = rows.value(i, cloud, figure)) out.push_back(*value);
  return out;
}

/// "50.2 (46.1 to 54.4)"; one value has no range
std::string mean_and_range(const std::vector<double>& values, const ShownFigure& as) {
  if (values.empty()) return "none";
  const Spread s = spread_of(values);
  if (s.n == 1) return number_text(as.factor * s.mean, as.digits);
  return fmt::format("{} ({} to {})", number_text(as.factor * s.mean, as.digits),
                     number_text(as.factor * s.low, as.digits), number_text(as.factor * s.high, as.digits));
}

SweepTable grid_table(const Benchmark& benchmark, const SweepRows& rows) {
  SweepTable table{"Over the whole grid", "Mean ± standard deviation over the configurations.", {"measure"}, {}};
  for (const ShownFigure& column : shown_figures()) table.columns.emplace_back(column.label);
  const auto clouds = clouds_of(benchmark);
  for (std::size_t cloud = 0; cloud < clouds.size(); ++cloud) {
    table.rows.push_back({clouds[cloud]->name});
    for (const ShownFigure& column : shown_figures()) {
      const Spread s = spread_of(values_where(rows, cloud, column, [](Loops) { return true; }));
      table.rows.back().push_back(s.n == 0 ? "none"
                                           : fmt::format("{} ± {}", number_text(column.factor * s.mean, column.digits),
                                                         number_text(column.factor * s.sd, column.digits)));
    }
  }
  return table;
}

SweepTable level_table(const Benchmark& benchmark, const SweepRows& rows, std::size_t loop, const ShownFigure& as) {
  const Updater& curves = benchmark.updaters[loop];
  SweepTable table{as.label, "Mean (range) over all others.", {axis_label(curves)}, {}};
  table.heading[0] = static_cast<char>(std::toupper(table.heading[0]));
  const auto clouds = clouds_of(benchmark);
  for (const Measure* measure : clouds) table.columns.push_back(measure->name);
  for (std::size_t i = 0; i < curves.count(); ++i) {
    const double level = curves.value(i);
    const auto at_level = [&](Loops loops) { return loops[loop] == level; };
    table.rows.push_back({level_text(curves, level)});
    for (std::size_t cloud = 0; cloud < clouds.size(); ++cloud)
      table.rows.back().push_back(mean_and_range(values_where(rows, cloud, as, at_level), as));
  }
  return table;
}

/// What the paper's text says of a figure, and where to look for it here.
struct PaperLine {
  const char *what, *paper, *detail;
  std::function<bool(Loops)> wanted;
  const char* only;  ///< of measures whose cloud's name holds this
};

SweepTable beside_paper(const Benchmark& benchmark, const SweepRows& rows, std::span<const PaperLine> lines) {
  SweepTable table{"Beside the paper's text",
                   "The paper gives no table of its figures. Means over the configurations that the words name, with "
                   "their range.",
                   {"what, mean (range)", "the paper"},
                   {}};
  const auto clouds = clouds_of(benchmark);
  for (const Measure* measure : clouds) table.columns.push_back(measure->name);
  for (const PaperLine& line : lines) {
    table.rows.push_back({line.what, line.paper});
    const ShownFigure& as = shown_figure_of(line.detail);
    for (std::size_t cloud = 0; cloud < clouds.size(); ++cloud)
      table.rows.back().push_back(clouds[cloud]->topic.find(line.only) == std::string::npos
                                      ? ""
                                      : mean_and_range(values_where(rows, cloud, as, line.wanted), as));
  }
  return table;
}

/// The paper's text on its Figures 8 and 9, and what was found here under the same words.
SweepTable figures_8_and_9(const Benchmark& benchmark, const SweepRows& rows, const SweepAxes& axes) {
  const auto x = static_cast<std::size_t>(axes.x), noise = static_cast<std::size_t>(axes.curve);
  const auto anywhere = [](Loops) { return true; };
  const auto bright = [&](Loops loops) { return loops[x] >= 0.5; };
  const auto dark = [&](Loops loops) { return loops[x] <= 0.2; };
  const auto very_bright = [&](Loops loops) { return loops[x] >= 0.8; };
  const auto clean = [&](Loops loops) { return bright(loops) && loops[noise] == 0; };
  const auto noisy = [&](Loops loops) { return bright(loops) && loops[noise] >= 0.1; };
  const PaperLine lines[] = {
      {"laser: coverage [%], everywhere", "about 50 in almost every situation", "coverage", anywhere, "laser"},
      {"stereo: coverage [%], light 0.5 and more", "40 in good light", "coverage", bright, "stereo"},
      {"stereo: coverage [%], light 0.2 and less", "needs some light", "coverage", dark, "stereo"},
      {"laser: mean error [mm], everywhere", "4", "mean_error", anywhere, "laser"},
      {"stereo: mean error [mm], light 0.5 and more", "4", "mean_error", bright, "stereo"},
      {"laser: standard deviation [mm]", "negligible", "stddev", anywhere, "laser"},
      {"stereo: standard deviation [mm], light 0.5 and more", "negligible", "stddev", bright, "stereo"},
      {"laser: outliers [%], light 0.2 and less", "fewer in the dark", "outliers", dark, "laser"},
      {"laser: outliers [%], light 0.8 and more", "more in the presence of light", "outliers", very_bright, "laser"},
      {"stereo: outliers [%], light 0.2 and less", "more in the absence of light", "outliers", dark, "stereo"},
      {"stereo: outliers [%], light 0.8 and more", "fewer in light", "outliers", very_bright, "stereo"},
      {"stereo: outliers [%], light 0.5 and more, no noise", "not negligible: floating particles", "outliers", clean,
       "stereo"},
      {"laser: outliers [%], light 0.5 and more, noise 0.10", "higher noise, more outliers", "outliers", noisy,
       "laser"},
      {"stereo: outliers [%], light 0.5 and more, noise 0.10", "higher noise, more outliers", "outliers", noisy,
       "stereo"},
  };
  return beside_paper(benchmark, rows, lines);
}

/// The paper's text on its real experiment, Figures 10 to 12.
SweepTable figure_10(const Benchmark& benchmark, const SweepRows& rows, std::size_t loop) {
  const Updater& levels = benchmark.updaters[loop];
  const double least = levels.levels.empty() ? levels.first : std::ranges::min(levels.levels);
  const auto anywhere = [](Loops) { return true; };
  const auto darkest = [&](Loops loops) { return loops[loop] == least; };
  const auto brightest = [&](Loops loops) { return loops[loop] == levels.highest(); };
  const PaperLine lines[] = {
      {"laser: coverage [%]", "32 to 38", "coverage", anywhere, "laser"},
      {"stereo: coverage [%], brightest level", "38 in good light", "coverage", brightest, "stereo"},
      {"stereo: coverage [%], darkest level", "completely dependent on light", "coverage", darkest, "stereo"},
      {"laser: mean error [mm]", "around 8", "mean_error", anywhere, "laser"},
      {"stereo: mean error [mm], brightest level", "around 8", "mean_error", brightest, "stereo"},
      {"laser: standard deviation [mm]", "around 8", "stddev", anywhere, "laser"},
      {"stereo: standard deviation [mm], brightest level", "around 5", "stddev", brightest, "stereo"},
      {"laser: outliers [%], darkest level", "more as light increases", "outliers", darkest, "laser"},
      {"laser: outliers [%], brightest level", "more as light increases", "outliers", brightest, "laser"},
      {"stereo: outliers [%], darkest level", "0: no points in the absence of light", "outliers", darkest, "stereo"},
      {"stereo: outliers [%], brightest level", "more as light increases", "outliers", brightest, "stereo"},
  };
  return beside_paper(benchmark, rows, lines);
}

}  // namespace

std::vector<SweepTable> sweep_tables(const Benchmark& benchmark, const SweepRows& rows) {
  const SweepAxes axes(benchmark);
  std::vector<SweepTable> tables;
  if (clouds_of(benchmark).empty() || axes.x < 0) return tables;
  tables.push_back(grid_table(benchmark, rows));
  const auto x = static_cast<std::size_t>(axes.x);
  if (axes.are_papers(benchmark)) tables.push_back(figures_8_and_9(benchmark, rows, axes));
  if (benchmark.updaters[x].kind == UpdaterKind::kLux) tables.push_back(figure_10(benchmark, rows, x));
  const std::size_t levels = axes.curve >= 0 ? static_cast<std::size_t>(axes.curve) : x;
  for (const ShownFigure& as : shown_figures()) tables.push_back(level_table(benchmark, rows, levels, as));
  return tables;
}

SweepTable sessions_table(const SweepRows& rows) {
  SweepTable table{"Sessions",
                   "Each is a folder with everything that was recorded, its clouds and its own report.",
                   {"session", "recorded", "light [lx]", "limit of error [lx]", "note"},
                   {}};
  const auto number = [](const std::optional<double>& lux) {
    return lux ? number_text(*lux, 1) : std::string("not known");
  };
  for (const SweepRows::Recording& r : rows.recordings())
    table.rows.push_back({r.session, r.recorded_utc, number(r.lux), number(r.lux_uncertainty), r.warning});
  return table;
}

SweepTable failures_table(const Benchmark& benchmark, const SweepRows& rows) {
  SweepTable table{"What failed", "", {"configuration"}, {}};
  for (const Updater& updater : benchmark.updaters) table.columns.emplace_back(updater.column());
  table.columns.emplace_back("error");
  for (const SweepRows::Failure& failure : rows.failures()) {
    table.rows.push_back({std::to_string(failure.point)});
    const std::vector<double> values = benchmark.values(failure.point);
    for (std::size_t i = 0; i < values.size(); ++i)
      table.rows.back().push_back(level_text(benchmark.updaters[i], values[i]));
    table.rows.back().push_back(failure.error);
  }
  if (rows.failed() > table.rows.size())
    table.note = fmt::format("The first {} of {}; results.csv has all.", table.rows.size(), rows.failed());
  return table;
}

}  // namespace tankrig
