#include "bench/sweep/sweep_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <mstch/mstch.hpp>
#include <set>

#include "bench/benchmark/point_store.hpp"
#include "bench/report/cloud_view.hpp"
#include "bench/report/picture_uri.hpp"
#include "bench/report/web_programs.hpp"
#include "bench/sweep/point_views.hpp"
#include "bench/sweep/sweep_report.hpp"
#include "bench/sweep/sweep_tables.hpp"
#include "bench/sweep/sweep_values.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig {

extern const char* const kSweepTemplate;  ///< sweep.html.mustache, compiled in

namespace {

using mstch::array;
using mstch::map;
using nlohmann::ordered_json;
namespace fs = std::filesystem;

const char* const kTable = R"(<h2>{{heading}}</h2>
<p>{{note}}</p>
<div class="wide"><table><thead><tr>{{#columns}}<th>{{.}}</th>{{/columns}}</tr></thead><tbody>
{{#rows}}
<tr>{{#cells}}<td>{{.}}</td>{{/cells}}</tr>
{{/rows}}
</tbody></table></div>
)";

std::string text_of(const ordered_json& run, const std::string& key) {
  const auto found = run.find(key);
  if (found == run.end() || found->is_null()) return "";
  return found->is_string() ? found->get<std::string>() : found->dump();
}

/// One recorded session is measured, in fog.
constexpr const char* kRecorded = "session_sha256";
bool is_recorded(const ordered_json& run) { return run.contains(kRecorded); }

/// Beside the paper's Figures 8 and 9, if light and noise are the axes.
array chart_nodes(const Benchmark& benchmark, const SweepRows& rows, const std::set<std::size_t>& linked) {
  array nodes;
  const SweepAxes axes(benchmark);
  if (clouds_of(benchmark).empty() || axes.x < 0) return nodes;
  for (const ShownFigure& figure : shown_figures()) {
    std::string heading = figure.label;
    heading[0] = static_cast<char>(std::toupper(heading[0]));
    std::string caption =
        "A dot is the mean over all other loops. Bars: 95 % intervals, of the mean where there are three values or "
        "more.";
    if (axes.are_papers(benchmark) && figure.detail == std::string("coverage"))
      caption = "In the form of the paper's Figure 8. " + caption;
    if (axes.are_papers(benchmark) && figure.detail == std::string("outliers"))
      caption = "In the form of the paper's Figure 9. " + caption;
    const bool over_lux = benchmark.updaters[static_cast<std::size_t>(axes.x)].kind == UpdaterKind::kLux;
    if (over_lux && (figure.detail == std::string("coverage") || figure.detail == std::string("outliers")))
      caption = "In the form of the paper's Figure 10. " + caption;
    const Chart chart = sweep_chart(benchmark, rows, figure.detail);
    nodes.push_back(map{{"heading", heading},
                        {"svg", chart_svg(chart, linked)},
                        {"data", plots_program().empty() ? "" : script_json(chart_json(chart, linked))},
                        {"caption", caption}});
  }
  return nodes;
}

mstch::node pictures(const fs::path& folder, const std::vector<std::pair<std::string, std::string>>& wanted) {
  array nodes;
  for (const auto& [name, caption] : wanted) {
    const fs::path file = folder / "figures" / name;
    if (fs::exists(file)) nodes.push_back(map{{"uri", picture_uri(file)}, {"caption", caption}});
  }
  if (nodes.empty()) return nullptr;
  return map{{"pictures", nodes}};
}

/// Of the clouds that the run has kept.
mstch::node cloud_view_node(const fs::path& folder) {
  const fs::path data = folder / "figures" / kCloudView;
  if (cloud_view_program().empty() || !fs::exists(data)) return nullptr;
  const std::string text = read_whole_file(data);
  if (text.find('<') != std::string::npos) throw InputError(data, "found '<', expected what tankrig bench writes");
  return map{{"data", text}, {"program", cloud_view_program()}};
}

array table_nodes(const std::vector<SweepTable>& tables) {
  array nodes;
  for (const SweepTable& table : tables) {
    array rows;
    for (const auto& row : table.rows) rows.push_back(map{{"cells", array(row.begin(), row.end())}});
    nodes.push_back(map{{"heading", table.heading},
                        {"note", table.note},
                        {"columns", array(table.columns.begin(), table.columns.end())},
                        {"rows", rows}});
  }
  return nodes;
}

/// The options that a scan and a benchmark share.
std::string shared_options(const ordered_json& run) {
  std::string text = " --rig " + text_of(run, "rig");
  if (const std::string preset = text_of(run, "preset"); !preset.empty()) text += " --preset " + preset;
  if (const std::string sensor = text_of(run, "sensor"); sensor != "scene") text += " --sensor " + sensor;
  if (const std::string more = text_of(run, kOptions); !more.empty()) text += " " + more;
  return text;
}

/// What scans this configuration: its frames have the same bits. Nothing where a scan has no option for one of the loops.
std::optional<std::string> scan_command(const Benchmark& benchmark, const ordered_json& run, std::size_t point) {
  std::string command = "tankrig scan" + shared_options(run);
  std::uint64_t seed = run.value("seed", std::uint64_t{1});
  const std::vector<double> values = benchmark.values(point);
  for (std::size_t i = 0; i < values.size(); ++i) {
    switch (benchmark.updaters[i].kind) {
      case UpdaterKind::kLight:
        command += " --light " + exact_text(values[i]);
        break;
      case UpdaterKind::kNoise:
        command += " --noise " + exact_text(values[i]);
        break;
      case UpdaterKind::kParticles:
        command += " --particles " + exact_text(values[i]);
        break;
      case UpdaterKind::kRepeat:
        seed += static_cast<std::uint64_t>(values[i]);
        break;
      case UpdaterKind::kAlgorithm:
      case UpdaterKind::kCalibrationError:
        break;  // a matter of evaluation
      default:
        return std::nullopt;
    }
  }
  return command + fmt::format(" --seed {}", seed);
}

/// "Noise 0.1, Light 0.5"
std::string condition_text(const Benchmark& benchmark, std::size_t point) {
  std::string text;
  const std::vector<double> values = benchmark.values(point);
  for (std::size_t i = 0; i < values.size(); ++i)
    text += fmt::format("{}{} {}", i ? ", " : "", benchmark.updaters[i].column(),
                        level_text(benchmark.updaters[i], values[i]));
  return text;
}

/// "laser: coverage of the surface 92.1 %, ..." of one configuration.
std::string figures_text(const Benchmark& benchmark, const SweepRows& rows, std::size_t place,
                         const std::string& measure) {
  const auto clouds = clouds_of(benchmark);
  const auto found = std::ranges::find(clouds, measure, &Measure::name);
  std::string text;
  if (found == clouds.end()) return text;
  for (const ShownFigure& figure : shown_figures())
    if (const auto value = rows.value(place, static_cast<std::size_t>(found - clouds.begin()), figure))
      text += fmt::format("; {}: {}", figure.label, number_text(figure.factor * *value, figure.digits));
  return text;
}

/// A row for each level of the curves with a link to each configuration of `linked`.
array index_nodes(const Benchmark& benchmark, const std::set<std::size_t>& linked) {
  const SweepAxes axes(benchmark);
  const auto name = [&](int loop, std::size_t point) {
    if (loop < 0) return std::string();
    const auto i = static_cast<std::size_t>(loop);
    return std::string(benchmark.updaters[i].column()) + " " +
           level_text(benchmark.updaters[i], benchmark.values(point)[i]);
  };
  std::map<std::pair<double, std::string>, array> rows;
  for (const std::size_t point : linked) {
    const double level = axes.curve < 0 ? 0 : benchmark.values(point)[static_cast<std::size_t>(axes.curve)];
    const std::string text = name(axes.x, point);
    rows[{level, name(axes.curve, point)}].push_back(
        map{{"target", std::to_string(point)}, {"text", text.empty() ? "the configuration" : text}});
  }
  array nodes;
  for (const auto& [level, cells] : rows) nodes.push_back(map{{"name", level.second}, {"cells", cells}});
  return nodes;
}

/// Of the recording that a configuration of an experiment is measured on.
const SweepRows::Recording* recording_of(const SweepRows& rows, std::size_t point) {
  const auto after = std::ranges::upper_bound(rows.recordings(), point, {}, &SweepRows::Recording::point);
  return after == rows.recordings().begin() ? nullptr : &*std::prev(after);
}

/// What stands behind the dots: the pictures that were kept, and the way to all frames.
array point_nodes(const Benchmark& benchmark, const ordered_json& run, const SweepRows& rows, const PointViews& views,
                  const std::set<std::size_t>& linked) {
  array points;
  for (const std::size_t point : linked) {
    array pictures;
    for (const PointView& view : views.at(point))
      pictures.push_back(
          map{{"uri", "data:image/jpeg;base64," + view.jpeg},
              {"caption", view.caption + figures_text(benchmark, rows, *rows.place(point), view.measure)}});
    const SweepRows::Recording* const recording = recording_of(rows, point);
    points.push_back(map{{"number", std::to_string(point)},
                         {"condition", condition_text(benchmark, point)},
                         {"pictures", pictures},
                         {"report", recording ? recording->session + "/report.html" : ""},
                         {"command", recording ? "" : scan_command(benchmark, run, point).value_or("")}});
  }
  return points;
}

/// Configurations with pictures.
std::set<std::size_t> viewed_points(const SweepRows& rows, const PointViews& views) {
  std::set<std::size_t> points;
  for (const auto& [point, pictures] : views)
    if (rows.place(point)) points.insert(point);
  return points;
}

array fact_nodes(const ordered_json& run) {
  array nodes;
  const std::pair<const char*, const char*> facts[] = {{"software", "tankrig"},
                                                       {"rig", "rig"},
                                                       {"sensor", "sensor model"},
                                                       {"seed", "seed of the first iteration"},
                                                       {"benchmark_sha256", "SHA-256 of the benchmark file"},
                                                       {"rig_sha256", "SHA-256 of the rig file, resolved"},
                                                       {"scene_sha256", "SHA-256 of the scene"},
                                                       {"object_sha256", "SHA-256 of the object's mesh"},
                                                       {"calibration_sha256", "SHA-256 of the calibration"}};
  for (const auto& [key, what] : facts) nodes.push_back(map{{"what", std::string(what)}, {"value", text_of(run, key)}});
  if (is_recorded(run))
    nodes.push_back(map{{"what", std::string("SHA-256 of the recorded session's session.yaml")},
                        {"value", text_of(run, kRecorded)}});
  if (run.contains("algorithms"))
    for (const auto& [name, hash] : run["algorithms"].items())
      nodes.push_back(map{{"what", "SHA-256 of the program " + name}, {"value", text_of(run["algorithms"], name)}});
  return nodes;
}

}  // namespace

std::string sweep_html(const fs::path& folder, const Benchmark& benchmark, const ordered_json& run,
                       const SweepRows& rows) {
  const std::size_t missing = benchmark.points() - std::min(benchmark.points(), rows.size());
  const PointViews views = read_views(folder);
  const std::set<std::size_t> linked = viewed_points(rows, views);
  const SweepTable failures = failures_table(benchmark, rows);
  array warnings;
  if (missing > 0)
    warnings.push_back(fmt::format("{} configurations are missing: run the benchmark again, it goes on.", missing));
  if (rows.failed() > 0) warnings.push_back(fmt::format("Something failed in {} configurations.", rows.failed()));
  std::vector<std::pair<std::string, std::string>> strips{
      {kViewsLight, "Over light, without added noise"},
      {kViewsNoise, "Over noise, in the brightest light"},
      {kViewsFog, "Over the fog that was added to the recorded pictures"},
      {kViewsOutside, "The rig from outside. In the form of the upper row of the paper's Figure 11"},
      {kViewsCamera,
       "What the laser's camera sees in the middle of the sweep. In the form of the lower row of "
       "the paper's Figure 11"}},
      clouds{{kCloudGrid, "Green on the object, black ground, blue outliers. In the form of the paper's Figure 12"}};
  const SweepTable sessions = sessions_table(rows);
  for (const Measure* measure : clouds_of(benchmark))
    clouds.emplace_back(
        "cloud_" + measure->name + ".png",
        measure->name + " in the brightest, quietest configuration: green on the object, black ground, blue outliers");
  const std::string scan = "tankrig scan" + shared_options(run) + " --light LIGHT --noise NOISE --seed SEED";
  map behind;
  if (sessions.rows.empty() && !is_recorded(run)) behind["scan"] = map{{"command", scan}};
  if (!linked.empty())
    behind["frames"] =
        map{{"rows", index_nodes(benchmark, linked)}, {"points", point_nodes(benchmark, run, rows, views, linked)}};
  std::string loops;
  for (const Updater& updater : benchmark.updaters)
    loops += fmt::format("{}{} {}", loops.empty() ? "" : " x ", updater.count(), updater.column());
  return mstch::render(
      kSweepTemplate,
      map{{"title", benchmark.file.stem().string()},
          {"summary", fmt::format("{} configurations of {} ({}), {} with a failure.", rows.size(), benchmark.points(),
                                  loops.empty() ? "no loop" : loops, rows.failed())},
          {"warnings", warnings},
          {"charts", chart_nodes(benchmark, rows, linked)},
          {"plots", plots_program()},
          {"views", pictures(folder, strips)},
          {"clouds", pictures(folder, clouds)},
          {"cloud_view", cloud_view_node(folder)},
          {"failures", failures.rows.empty() ? array() : table_nodes({failures})},
          {"tables", table_nodes(sweep_tables(benchmark, rows))},
          {"sessions", sessions.rows.empty() ? array() : table_nodes({sessions})},
          {"behind", behind.empty() ? mstch::node() : mstch::node(behind)},
          {"command", "tankrig " + run.value("command", "bench") + " " + benchmark.file.filename().string() +
                          shared_options(run) + " --seed " + text_of(run, "seed")},
          {"facts", fact_nodes(run)}},
      {{"links", std::string(kLinksTemplate)}, {"table", std::string(kTable)}, {"view", std::string(kViewTemplate)}});
}

}  // namespace tankrig
