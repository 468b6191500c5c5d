#include "bench/benchmark/point_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>

#include "bench/benchmark/function.hpp"
#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig {
namespace {

const char* const kPoints = "points.jsonl";

std::string line_of(std::size_t point, const ordered_json& row) {
  ordered_json line{{"point", point}};
  line.update(row);
  return line.dump() + "\n";
}

/// Takes the line ends of whole lines; what follows the last one was cut. `whole` becomes their length.
std::pair<ordered_json, PointRows> parsed(const fs::path& file, const std::string& text, std::size_t& whole) {
  ordered_json run;
  PointRows rows;
  whole = 0;
  for (int number = 1;; ++number) {
    const std::size_t end = text.find('\n', whole);
    if (end == std::string::npos) break;
    ordered_json line = ordered_json::parse(text.begin() + static_cast<long>(whole),
                                            text.begin() + static_cast<long>(end), nullptr, false);
    const bool first = number == 1;
    if (!line.is_object() ||
        (first ? !line.contains("benchmark_sha256")
               : !line.contains("point") || !line["point"].is_number_unsigned() || !line.contains("values")))
      throw InputError(file, number,
                       first ? "found no run of a benchmark, expected what tankrig bench writes"
                             : "found no configuration's results, expected one a line");
    if (first) {
      run = std::move(line);
    } else {
      const auto point = line["point"].get<std::size_t>();
      line.erase("point");
      rows[point] = std::move(line);
    }
    whole = end + 1;
  }
  return {std::move(run), std::move(rows)};
}

/// Where a folder of an earlier run goes on; cuts an unfinished line off.
fs::path prepared(const fs::path& folder, const ordered_json& run, PointRows& rows) {
  fs::create_directories(folder);
  const fs::path file = folder / kPoints;
  if (!fs::exists(file)) {
    if (!fs::is_empty(folder)) throw InputError(folder, "is not empty, expected a new folder or one of this benchmark");
    write_file_durably(file, run.dump() + "\n");
    return file;
  }
  std::size_t whole = 0;
  auto [before, found] = parsed(file, read_whole_file(file), whole);
  check_run(folder, before, run);
  fs::resize_file(file, whole);
  rows = std::move(found);
  return file;
}

std::string cell(const ordered_json& value) { return value.is_number() ? exact_text(value.get<double>()) : ""; }

/// The details that stand in the table: all, or the first alone.
std::size_t tabled(const Measure& measure) {
  return measure.detailed_to_globals ? details_of(measure.kind, measure.arithmetic).size() : 1;
}

std::string header(const Benchmark& benchmark) {
  std::string line = "point";
  for (const Updater& updater : benchmark.updaters) line += std::string(",") + updater.column();
  for (const Measure& measure : benchmark.measures)
    for (std::size_t i = 0; i < tabled(measure); ++i) {
      const std::string& detail = details_of(measure.kind, measure.arithmetic)[i];
      const std::string& unit = units_of(measure.kind, measure.arithmetic)[i];
      line += fmt::format(",{}.{} [{}]", measure.name, detail, unit);
      if (measure.kind == MeasureKind::kReconstruction3D && measure.arithmetic == Arithmetic::kPaper)
        line += fmt::format(",{0}.{1} low95 [{2}],{0}.{1} high95 [{2}]", measure.name, detail, unit);
    }
  for (const Function& function : benchmark.functions) line += "," + function.name + " [1]";
  return line + ",SimTime [s],error\n";
}

std::string words(const ordered_json& text) { return text.is_string() ? text.get<std::string>() : text.dump(); }

/// The file may be from elsewhere, and what follows takes a row's values for its loops'.
void check_values(const fs::path& folder, const Benchmark& benchmark, const PointRows& rows) {
  for (const auto& [point, row] : rows) {
    const ordered_json expected =
        point < benchmark.points() ? ordered_json(benchmark.values(point)) : ordered_json("no such configuration");
    if (row["values"] != expected)
      throw InputError(folder / kPoints, fmt::format("configuration {}: values: found {}, expected {}", point,
                                                     row["values"].dump(), words(expected)));
  }
}

/// The values of a configuration's loops, each after a comma.
std::string loop_cells(const Benchmark& benchmark, const ordered_json& row) {
  std::string text;
  for (std::size_t i = 0; i < row["values"].size(); ++i)
    text += "," + benchmark.updaters[i].shown(row["values"][i].get<double>());
  return text;
}

std::string row_of(const Benchmark& benchmark, std::size_t point, const ordered_json& row) {
  std::string line = std::to_string(point) + loop_cells(benchmark, row);
  const ordered_json none = ordered_json::object();
  const auto part = [&](const ordered_json& whole, const std::string& key) -> const ordered_json& {
    const auto found = whole.find(key);
    return found == whole.end() ? none : *found;
  };
  for (const Measure& measure : benchmark.measures) {
    const ordered_json& values = part(part(row, "measures"), measure.name);
    for (std::size_t i = 0; i < tabled(measure); ++i) {
      const std::string& detail = details_of(measure.kind, measure.arithmetic)[i];
      line += "," + cell(part(values, detail));
      if (measure.kind != MeasureKind::kReconstruction3D || measure.arithmetic != Arithmetic::kPaper) continue;
      const ordered_json& interval = part(part(values, "interval95"), detail);
      line += interval.is_array() && interval.size() == 2 ? "," + cell(interval[0]) + "," + cell(interval[1]) : ",,";
    }
  }
  for (const Function& function : benchmark.functions) line += "," + cell(part(part(row, "functions"), function.name));
  line += "," + cell(part(row, "simulated_s")) + ",";
  line += csv_field(point_error(row));
  return line + "\n";
}

void write_log(const fs::path& folder, const Benchmark& benchmark, const Measure& measure, const PointRows& rows) {
  std::string text = "point";
  for (const Updater& updater : benchmark.updaters) text += std::string(",") + updater.column();
  text += ",time [s]";
  const auto& details = details_of(measure.kind, measure.arithmetic);
  const auto& units = units_of(measure.kind, measure.arithmetic);
  for (std::size_t i = 0; i < details.size(); ++i) text += fmt::format(",{} [{}]", details[i], units[i]);
  text += "\n";
  for (const auto& [point, row] : rows) {
    if (!row.contains("logs") || !row["logs"].contains(measure.name)) continue;
    for (const auto& entry : row["logs"][measure.name]) {
      text += std::to_string(point) + loop_cells(benchmark, row);
      for (const auto& value : entry) text += "," + cell(value);
      text += "\n";
    }
  }
  fs::create_directories(folder / "logs");
  write_file_durably(folder / "logs" / (measure.name + ".csv"), text);
}

}  // namespace

void check_run(const fs::path& folder, const ordered_json& before, const ordered_json& run) {
  for (const ordered_json* one : {&before, &run})
    for (const auto& [key, value] : one->items())
      if (const ordered_json found = before.value(key, ordered_json()), expected = run.value(key, ordered_json());
          found != expected)
        throw InputError(folder, fmt::format("holds results of another run: {} is {}, expected {}; give another --out",
                                             key, found.dump(), expected.dump()));
}

PointStore::PointStore(const fs::path& folder, const ordered_json& run) : file_(prepared(folder, run, rows_)) {
  reused_ = rows_.size();
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor_ < 0) throw CannotWrite(file_, errno);
}

PointStore::~PointStore() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void PointStore::add(std::size_t point, ordered_json row) {
  const std::lock_guard lock(mutex_);
  const std::string line = line_of(point, row);
  std::string_view left = line;
  write_all(file_, descriptor_, left);
  sync_file(file_, descriptor_);
  rows_[point] = std::move(row);
}

void drop_loops_left_out(Benchmark& benchmark, const ordered_json& run) {
  if (!run.contains(kLoopsLeftOut)) return;
  for (const auto& line : run[kLoopsLeftOut])
    std::erase_if(benchmark.updaters, [&](const Updater& updater) { return line == updater.line; });
}

std::string point_error(const ordered_json& row) {
  if (row.contains("error")) return words(row["error"]);
  std::string text;
  if (row.contains("measures"))
    for (const auto& [name, values] : row["measures"].items())
      if (values.contains("error")) text += (text.empty() ? "" : "; ") + name + ": " + words(values["error"]);
  return text;
}

std::pair<ordered_json, PointRows> read_points(const fs::path& folder) {
  const fs::path file = folder / kPoints;
  std::size_t whole = 0;
  auto found = parsed(file, read_whole_file(file), whole);
  if (found.first.is_null()) throw InputError(file, "is empty, expected results of tankrig bench");
  return found;
}

void write_result_tables(const fs::path& folder, const Benchmark& benchmark, const ordered_json& run,
                         const PointRows& rows) {
  check_values(folder, benchmark, rows);
  std::string table = header(benchmark);
  ordered_json all{{"run", run}, {"points", ordered_json::array()}};
  for (const auto& [point, row] : rows) {
    table += row_of(benchmark, point, row);
    all["points"].push_back({{"point", point}});
    all["points"].back().update(row);
  }
  write_file_durably(folder / "results.csv", table);
  write_file_durably(folder / "results.json", all.dump(1) + "\n");
  for (const Measure& measure : benchmark.measures)
    if (measure.log_s) write_log(folder, benchmark, measure, rows);
}

}  // namespace tankrig
