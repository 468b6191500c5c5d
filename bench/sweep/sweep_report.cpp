#include "bench/sweep/sweep_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "core/atomic_file.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig {
namespace {

struct Shown {
  const char *detail, *label;
  double factor;
  int digits;
};
constexpr Shown kShown[] = {{"coverage", "coverage of the surface [%]", 100, 1},
                            {"outliers", "outliers [%]", 100, 2},
                            {"mean_error", "mean error [mm]", 1000, 3},
                            {"stddev", "standard deviation [mm]", 1000, 3},
                            {"of_ceiling", "coverage of what can be seen [%]", 100, 1}};

const Shown& shown(const std::string& detail) {
  return *std::find_if(std::begin(kShown), std::end(kShown), [&](const Shown& s) { return detail == s.detail; });
}

/// Which loops are drawn as what; -1: none is.
struct Axes {
  int x = -1, curve = -1;

  explicit Axes(const Benchmark& benchmark) {
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
};

const char* axis_label(const Updater& updater) {
  switch (updater.kind) {
    case UpdaterKind::kLight:
      return "ambient light [share of the reference]";
    case UpdaterKind::kNoise:
      return "noise [share of full scale]";
    case UpdaterKind::kFog:
      return "added attenuation [1/m]";
    case UpdaterKind::kCurrent:
      return "current [m/s]";
    case UpdaterKind::kParticles:
      return "particles [1/m3]";
    case UpdaterKind::kSweepSpeed:
      return "sweep [rad/s]";
    case UpdaterKind::kAlgorithm:
      return "algorithm";
    default:
      return "iteration";
  }
}

std::optional<double> value_of(const ordered_json& row, const std::string& measure, const std::string& detail) {
  if (!row.contains("measures") || !row["measures"].contains(measure)) return std::nullopt;
  const auto& values = row["measures"][measure];
  if (!values.contains(detail) || !values[detail].is_number()) return std::nullopt;
  return values[detail].get<double>();
}

struct Spread {
  double mean = 0, sd = 0, low = 0, high = 0;
  std::size_t n = 0;
};

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

/// Values of a detail at the configurations for which `wanted` holds.
template <class Wanted>
std::vector<double> values_where(const PointRows& rows, const std::string& measure, const std::string& detail,
                                 Wanted wanted) {
  std::vector<double> out;
  for (const auto& [point, row] : rows)
    if (wanted(row))
      if (const auto value = value_of(row, measure, detail)) out.push_back(*value);
  return out;
}

std::string number(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

/// "50.2 (46.1 to 54.4)"
std::string mean_and_range(const std::vector<double>& values, const Shown& as) {
  if (values.empty()) return "none";
  const Spread s = spread_of(values);
  return fmt::format("{} ({} to {})", number(as.factor * s.mean, as.digits), number(as.factor * s.low, as.digits),
                     number(as.factor * s.high, as.digits));
}

std::string grid_table(const Benchmark& benchmark, const PointRows& rows) {
  std::string text = "| measure |";
  for (const Shown& column : kShown) text += fmt::format(" {} |", column.label);
  text += "\n|---|---|---|---|---|---|\n";
  for (const Measure* measure : clouds_of(benchmark)) {
    text += "| " + measure->name + " |";
    for (const Shown& column : kShown) {
      const Spread s = spread_of(values_where(rows, measure->name, column.detail, [](const auto&) { return true; }));
      text += s.n == 0 ? " none |"
                       : fmt::format(" {} ± {} |", number(column.factor * s.mean, column.digits),
                                     number(column.factor * s.sd, column.digits));
    }
    text += "\n";
  }
  return text;
}

std::string curve_table(const Benchmark& benchmark, const PointRows& rows, const Axes& axes, const Shown& as) {
  const Updater& curves = benchmark.updaters[static_cast<std::size_t>(axes.curve)];
  std::string text = fmt::format("| {} |", axis_label(curves));
  std::string line = "\n|---|";
  for (const Measure* measure : clouds_of(benchmark)) text += " " + measure->name + " |", line += "---|";
  text += line + "\n";
  for (std::size_t i = 0; i < curves.count(); ++i) {
    const double level = curves.value(i);
    text += fmt::format("| {} |",
                        curves.kind == UpdaterKind::kAlgorithm ? curves.shown(level) : fmt::format("{:g}", level));
    for (const Measure* measure : clouds_of(benchmark))
      text += " " +
              mean_and_range(values_where(rows, measure->name, as.detail,
                                          [&](const ordered_json& row) {
                                            return row["values"][static_cast<std::size_t>(axes.curve)] == level;
                                          }),
                             as) +
              " |";
    text += "\n";
  }
  return text;
}

/// The paper's text on its Figures 8 and 9, and what was found here under the same words.
std::string paper_table(const Benchmark& benchmark, const PointRows& rows, const Axes& axes) {
  const auto x = static_cast<std::size_t>(axes.x), noise = static_cast<std::size_t>(axes.curve);
  const auto light = [&](const ordered_json& row) { return row["values"][x].get<double>(); };
  const auto noise_of = [&](const ordered_json& row) { return row["values"][noise].get<double>(); };
  const auto anywhere = [](const ordered_json&) { return true; };
  const auto bright = [&](const ordered_json& row) { return light(row) >= 0.5; };
  const auto dark = [&](const ordered_json& row) { return light(row) <= 0.2; };
  const auto very_bright = [&](const ordered_json& row) { return light(row) >= 0.8; };
  const auto clean = [&](const ordered_json& row) { return bright(row) && noise_of(row) == 0; };
  const auto noisy = [&](const ordered_json& row) { return bright(row) && noise_of(row) >= 0.1; };
  const struct {
    const char *what, *paper, *detail;
    std::function<bool(const ordered_json&)> wanted;
    const char* only;
  } lines[] = {
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
  std::string text = "| what, mean (range) | the paper |";
  const auto clouds = clouds_of(benchmark);
  std::string rule = "\n|---|---|";
  for (const Measure* measure : clouds) text += " " + measure->name + " |", rule += "---|";
  text += rule + "\n";
  for (const auto& line : lines) {
    text += fmt::format("| {} | {} |", line.what, line.paper);
    for (const Measure* measure : clouds)
      text +=
          measure->topic.find(line.only) == std::string::npos
              ? " |"
              : " " + mean_and_range(values_where(rows, measure->name, line.detail, line.wanted), shown(line.detail)) +
                    " |";
    text += "\n";
  }
  return text;
}

}  // namespace

Chart sweep_chart(const Benchmark& benchmark, const PointRows& rows, const std::string& detail) {
  const Axes axes(benchmark);
  const Shown& as = shown(detail);
  Chart chart;
  if (axes.x < 0) return chart;
  const Updater& x = benchmark.updaters[static_cast<std::size_t>(axes.x)];
  for (const Measure* measure : clouds_of(benchmark)) {
    struct Cell {
      std::vector<double> values;
      std::optional<std::array<double, 2>> interval;
    };
    std::map<double, std::map<double, Cell>> curves;
    for (const auto& [point, row] : rows) {
      const auto value = value_of(row, measure->name, detail);
      if (!value) continue;
      const double level = axes.curve < 0 ? 0 : row["values"][static_cast<std::size_t>(axes.curve)].get<double>();
      Cell& cell = curves[level][row["values"][static_cast<std::size_t>(axes.x)].get<double>()];
      cell.values.push_back(as.factor * *value);
      const auto& values = row["measures"][measure->name];
      if (values.contains("interval95") && values["interval95"].contains(detail) &&
          values["interval95"][detail].is_array())
        cell.interval = {as.factor * values["interval95"][detail][0].template get<double>(),
                         as.factor * values["interval95"][detail][1].template get<double>()};
    }
    ChartPanel panel{measure->name, axis_label(x), as.label, {}};
    for (const auto& [level, cells] : curves) {
      ChartCurve curve;
      if (axes.curve >= 0) {
        const Updater& loop = benchmark.updaters[static_cast<std::size_t>(axes.curve)];
        curve.name =
            loop.kind == UpdaterKind::kAlgorithm ? loop.shown(level) : fmt::format("{} {:g}", loop.column(), level);
      }
      for (const auto& [at, cell] : cells) {
        const Spread s = spread_of(cell.values);
        ChartPoint p{at, s.mean, cell.interval};
        if (s.n >= 3) {
          const boost::math::students_t student(static_cast<double>(s.n - 1));
          const double half = boost::math::quantile(student, 0.975) * s.sd / std::sqrt(static_cast<double>(s.n));
          p.interval = {std::max(0.0, s.mean - half), s.mean + half};
        }
        curve.points.push_back(p);
      }
      panel.curves.push_back(std::move(curve));
    }
    chart.panels.push_back(std::move(panel));
  }
  return chart;
}

std::vector<std::string> write_sweep_figures(const fs::path& folder, const Benchmark& benchmark,
                                             const PointRows& rows) {
  std::vector<std::string> names;
  if (clouds_of(benchmark).empty() || Axes(benchmark).x < 0) return names;
  fs::create_directories(folder / "figures");
  for (const char* detail : {"coverage", "outliers", "mean_error", "stddev"}) {
    const Chart chart = sweep_chart(benchmark, rows, detail);
    std::vector<unsigned char> png;
    if (!cv::imencode(".png", chart_picture(chart), png)) throw InputError(folder, "a figure cannot be encoded");
    write_whole_file(folder / "figures" / (std::string(detail) + ".svg"), chart_svg(chart));
    write_whole_file(folder / "figures" / (std::string(detail) + ".png"),
                     {reinterpret_cast<const char*>(png.data()), png.size()});
    names.push_back(std::string(detail) + ".svg");
  }
  return names;
}

std::string sweep_page(const Benchmark& benchmark, const ordered_json& run, const PointRows& rows,
                       const std::vector<std::string>& figures) {
  const Axes axes(benchmark);
  std::size_t failed = 0;
  for (const auto& [point, row] : rows) failed += !point_error(row).empty();
  std::string text = fmt::format("# {}\n", benchmark.file.stem().string());
  text += fmt::format(
      "Made by `tankrig bench {}`: {} configurations of {}, {} failed. tankrig {}, rig {}, sensor {}, seed {}. "
      "SHA-256: benchmark {:.12}, rig "
      "{:.12}, "
      "scene {:.12}, object {:.12}, calibration {:.12}.\n\n",
      benchmark.file.filename().string(), rows.size(), benchmark.points(), failed, run.value("software", ""),
      run.value("rig", ""), run.value("sensor", ""), run.value("seed", 0), run.value("benchmark_sha256", ""),
      run.value("rig_sha256", ""), run.value("scene_sha256", ""), run.value("object_sha256", ""),
      run.value("calibration_sha256", ""));
  if (clouds_of(benchmark).empty() || axes.x < 0) return text;
  text +=
      "## Over the whole grid\nMean ± standard deviation over the configurations.\n\n" + grid_table(benchmark, rows);
  const bool is_papers = benchmark.updaters[static_cast<std::size_t>(axes.x)].kind == UpdaterKind::kLight &&
                         axes.curve >= 0 &&
                         benchmark.updaters[static_cast<std::size_t>(axes.curve)].kind == UpdaterKind::kNoise;
  if (is_papers)
    text +=
        "\n## Beside the paper's text\nThe paper gives no table of its figures. Means over the configurations that the "
        "words name, with their range.\n\n" +
        paper_table(benchmark, rows, axes);
  if (axes.curve >= 0)
    for (const Shown& as : kShown)
      text += fmt::format("\n## {}{}\nMean (range) over all others.\n\n", static_cast<char>(std::toupper(as.label[0])),
                          as.label + 1) +
              curve_table(benchmark, rows, axes, as);
  if (!figures.empty()) text += "\n## Figures\n";
  for (const std::string& figure : figures) text += fmt::format("![{}](figures/{})\n\n", figure, figure);
  return text;
}

}  // namespace tankrig
