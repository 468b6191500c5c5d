#include "rig/plan/plan_csv.hpp"

#include <array>
#include <cmath>

#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

enum Column { kName, kPhase, kPass, kLaser, kSweeping, kBegin, kDuration, kRecordBegin, kRecordEnd };
const std::vector<std::string> kColumns{"segment", "phase",      "pass",           "laser",       "sweeping",
                                        "begin_s", "duration_s", "record_begin_s", "record_end_s"};
constexpr std::array kPhases{Phase::kMove, Phase::kDarkBefore, Phase::kSweep, Phase::kDarkAfter};

template <class T>
T number(const CsvTable& table, const CsvRow& row, Column column, T lowest) {
  T value{};
  if (!parse_number(row.fields[column], value) || !(value >= lowest) || !std::isfinite(static_cast<double>(value)))
    table.fail(row, column, "a number of at least " + std::to_string(lowest));
  return value;
}

bool flag(const CsvTable& table, const CsvRow& row, Column column) {
  const std::string& text = row.fields[column];
  if (text != "0" && text != "1") table.fail(row, column, "0 or 1");
  return text == "1";
}

Segment segment_of(const CsvTable& table, const CsvRow& row) {
  Segment s;
  s.name = row.fields[kName];
  bool known = false;
  for (const Phase phase : kPhases)
    if (row.fields[kPhase] == to_string(phase)) s.phase = phase, known = true;
  if (!known) table.fail(row, kPhase, "move, dark_before, sweep or dark_after");
  s.pass = number(table, row, kPass, 0);
  s.laser = flag(table, row, kLaser);
  s.sweeping = flag(table, row, kSweeping);
  s.begin = number(table, row, kBegin, 0.0);
  s.duration = number(table, row, kDuration, 0.0);
  s.record_begin = number(table, row, kRecordBegin, 0.0);
  s.record_end = number(table, row, kRecordEnd, 0.0);
  return s;
}

}  // namespace

std::string plan_csv(const ScanPlan& plan) {
  std::string out;
  for (const std::string& column : kColumns) out += (out.empty() ? "" : ",") + column;
  out += '\n';
  for (const Segment& s : plan.segments()) {
    out += csv_field(s.name) + ',' + to_string(s.phase) + ',' + std::to_string(s.pass) + ',' + (s.laser ? '1' : '0') +
           ',' + (s.sweeping ? '1' : '0');
    for (const double t : {s.begin, s.duration, s.record_begin, s.record_end}) out += ',' + exact_text(t);
    out += '\n';
  }
  return out;
}

ScanPlan read_plan_csv(const std::filesystem::path& file) {
  const CsvTable table = read_csv(file, kColumns);
  std::vector<Segment> segments;
  for (const CsvRow& row : table.rows) segments.push_back(segment_of(table, row));
  if (segments.empty()) throw InputError(file, "holds no segment, expected a scan's plan");
  return ScanPlan(std::move(segments));
}

}  // namespace tankrig
