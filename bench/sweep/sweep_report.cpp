#include "bench/sweep/sweep_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>

#include "bench/benchmark/point_store.hpp"
#include "bench/sweep/sweep_tables.hpp"
#include "bench/sweep/sweep_values.hpp"
#include "core/atomic_file.hpp"
#include "core/picture_codecs.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig {
namespace {

std::string markdown(const SweepTable& table) {
  const auto line = [](const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const std::string& cell : cells) text += (cell.empty() ? "" : " ") + cell + " |";
    return text + "\n";
  };
  std::string text = line(table.columns) + "|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) text += "---|";
  text += "\n";
  for (const auto& row : table.rows) text += line(row);
  return text;
}

}  // namespace

Chart sweep_chart(const Benchmark& benchmark, const SweepRows& rows, const std::string& detail) {
  const SweepAxes axes(benchmark);
  const ShownFigure& as = shown_figure_of(detail);
  Chart chart;
  if (axes.x < 0) return chart;
  const Updater& x = benchmark.updaters[static_cast<std::size_t>(axes.x)];
  const auto clouds = clouds_of(benchmark);
  for (std::size_t cloud = 0; cloud < clouds.size(); ++cloud) {
    const Measure* const measure = clouds[cloud];
    struct Cell {
      std::size_t point = 0;
      std::vector<double> values;
      std::optional<std::array<double, 2>> interval;
    };
    std::map<double, std::map<double, Cell>> curves;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto value = rows.value(i, cloud, as);
      if (!value) continue;
      const auto loops = rows.loops(i);
      Cell& cell = curves[axes.curve < 0 ? 0 : loops[static_cast<std::size_t>(axes.curve)]]
                         [loops[static_cast<std::size_t>(axes.x)]];
      cell.point = rows.point(i);
      cell.values.push_back(as.factor * *value);
      if (const auto interval = rows.interval(i, cloud, as))
        cell.interval = {as.factor * (*interval)[0], as.factor * (*interval)[1]};
    }
    ChartPanel panel{axes.curve < 0 ? "" : measure->name, axis_label(x), as.label, {}};
    for (const auto& [level, cells] : curves) {
      ChartCurve curve{measure->name, {}};
      if (axes.curve >= 0) {
        const Updater& loop = benchmark.updaters[static_cast<std::size_t>(axes.curve)];
        curve.name =
            loop.kind == UpdaterKind::kAlgorithm ? loop.shown(level) : loop.column() + (" " + level_text(loop, level));
      }
      for (const auto& [at, cell] : cells) {
        const Spread s = spread_of(cell.values);
        ChartPoint p{at, s.mean, cell.interval, standing_for(benchmark, cell.point)};
        if (s.n >= 3) {
          const boost::math::students_t student(static_cast<double>(s.n - 1));
          const double half = boost::math::quantile(student, 0.975) * s.sd / std::sqrt(static_cast<double>(s.n));
          p.interval = {std::max(0.0, s.mean - half), s.mean + half};
        }
        curve.points.push_back(p);
      }
      panel.curves.push_back(std::move(curve));
    }
    if (axes.curve < 0 && !chart.panels.empty()) {
      for (ChartCurve& curve : panel.curves) chart.panels.front().curves.push_back(std::move(curve));
    } else {
      chart.panels.push_back(std::move(panel));
    }
  }
  return chart;
}

std::vector<std::string> write_sweep_figures(const fs::path& folder, const Benchmark& benchmark,
                                             const SweepRows& rows) {
  std::vector<std::string> names;
  if (clouds_of(benchmark).empty() || SweepAxes(benchmark).x < 0) return names;
  fs::create_directories(folder / "figures");
  for (const char* detail : {"coverage", "outliers", "mean_error", "stddev"}) {
    const Chart chart = sweep_chart(benchmark, rows, detail);
    write_whole_file(folder / "figures" / (std::string(detail) + ".svg"), chart_svg(chart));
    write_whole_file(folder / "figures" / (std::string(detail) + ".png"), picture_png(chart_picture(chart)));
    names.push_back(std::string(detail) + ".svg");
  }
  return names;
}

std::string sweep_page(const Benchmark& benchmark, const ordered_json& run, const SweepRows& rows,
                       const std::vector<std::string>& figures) {
  std::string text = fmt::format("# {}\n", benchmark.file.stem().string());
  text += fmt::format(
      "Made by `tankrig {} {}{}`: {} configurations of {}, {} failed. tankrig {}, rig {}, sensor {}, seed {}. "
      "SHA-256: benchmark {:.12}, rig "
      "{:.12}, "
      "scene {:.12}, object {:.12}, calibration {:.12}.\n\n",
      run.value("command", "bench"), benchmark.file.filename().string(),
      run.contains(kOptions) ? " " + run.value(kOptions, "") : "", rows.size(), benchmark.points(), rows.failed(),
      run.value("software", ""), run.value("rig", ""), run.value("sensor", ""), run.value("seed", 0),
      run.value("benchmark_sha256", ""), run.value("rig_sha256", ""), run.value("scene_sha256", ""),
      run.value("object_sha256", ""), run.value("calibration_sha256", ""));
  std::vector<SweepTable> tables = sweep_tables(benchmark, rows);
  if (SweepTable sessions = sessions_table(rows); !sessions.rows.empty()) tables.push_back(std::move(sessions));
  for (std::size_t i = 0; i < tables.size(); ++i)
    text += fmt::format("{}## {}\n{}\n\n", i ? "\n" : "", tables[i].heading, tables[i].note) + markdown(tables[i]);
  if (!figures.empty()) text += "\n## Figures\n";
  for (const std::string& figure : figures) text += fmt::format("![{}](figures/{})\n\n", figure, figure);
  return text;
}

}  // namespace tankrig
