#include "bench/benchmark/result_tables.hpp"

#include <fmt/format.h>

#include "bench/benchmark/function.hpp"
#include "bench/benchmark/point_store.hpp"
#include "core/atomic_file.hpp"
#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace tankrig {

/// A file that grows beside the one it replaces at the end.
class TableFile {
 public:
  explicit TableFile(const fs::path& file) : file_(file), fresh_(file) {}
  void add(std::string_view text) {
    waiting_ += text;
    if (waiting_.size() > (1U << 20)) flush();
  }
  void finish() {
    flush();
    fresh_.put_in_place_durably();
  }

 private:
  void flush() {
    std::string_view left = waiting_;
    write_all(file_, fresh_.descriptor(), left);
    waiting_.clear();
  }

  const fs::path file_;
  UnfinishedFile fresh_;
  std::string waiting_;
};

namespace {

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

std::string log_header(const Benchmark& benchmark, const Measure& measure) {
  std::string text = "point";
  for (const Updater& updater : benchmark.updaters) text += std::string(",") + updater.column();
  text += ",time [s]";
  const auto& details = details_of(measure.kind, measure.arithmetic);
  const auto& units = units_of(measure.kind, measure.arithmetic);
  for (std::size_t i = 0; i < details.size(); ++i) text += fmt::format(",{} [{}]", details[i], units[i]);
  return text + "\n";
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

void check_values(const fs::path& folder, const Benchmark& benchmark, std::size_t point, const ordered_json& row) {
  const bool known = point < benchmark.points();
  if (const ordered_json expected(known ? benchmark.values(point) : std::vector<double>());
      !known || row["values"] != expected)
    throw InputError(folder / "points.jsonl",
                     fmt::format("configuration {}: values: found {}, expected {}", point, row["values"].dump(),
                                 known ? expected.dump() : "no such configuration"));
}

}  // namespace

ResultTables::ResultTables(const fs::path& folder, const Benchmark& benchmark, const ordered_json& run)
    : folder_(folder),
      benchmark_(benchmark),
      csv_(std::make_unique<TableFile>(folder / "results.csv")),
      json_(std::make_unique<TableFile>(folder / "results.json")) {
  csv_->add(header(benchmark));
  json_->add("{\"run\":" + run.dump() + ",\n\"points\":[");
  for (const Measure& measure : benchmark.measures) {
    if (!measure.log_s) continue;
    fs::create_directories(folder / "logs");
    logs_.push_back({&measure, std::make_unique<TableFile>(folder / "logs" / (measure.name + ".csv"))});
    logs_.back().file->add(log_header(benchmark, measure));
  }
}

ResultTables::~ResultTables() = default;

void ResultTables::add(std::size_t point, const ordered_json& row) {
  check_values(folder_, benchmark_, point, row);
  csv_->add(row_of(benchmark_, point, row));
  ordered_json line{{"point", point}};
  line.update(row);
  json_->add((first_ ? "\n" : ",\n") + line.dump());
  first_ = false;
  for (const Log& log : logs_) {
    if (!row.contains("logs") || !row["logs"].contains(log.measure->name)) continue;
    for (const auto& entry : row["logs"][log.measure->name]) {
      std::string text = std::to_string(point) + loop_cells(benchmark_, row);
      for (const auto& value : entry) text += "," + cell(value);
      log.file->add(text + "\n");
    }
  }
}

void ResultTables::finish() {
  json_->add("\n]}\n");
  csv_->finish();
  json_->finish();
  for (const Log& log : logs_) log.file->finish();
}

}  // namespace tankrig
