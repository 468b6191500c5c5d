#include "session/reading/session_tables.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/plausible_length.hpp"
#include "core/session_names.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr std::array kPhases{Phase::kMove, Phase::kDarkBefore, Phase::kSweep, Phase::kDarkAfter};

void add_joint_columns(std::vector<std::string>& columns, const std::string& before, const std::string& after) {
  for (const char* joint : kJointNames) columns.push_back(before + joint + after);
}

std::vector<std::string> joints_columns() {
  std::vector<std::string> columns{"stamp_ns"};
  add_joint_columns(columns, "q_", "_rad");
  add_joint_columns(columns, "velocity_", "_rad_s");
  add_joint_columns(columns, "", "_ticks");
  columns.push_back("current_a");
  return columns;
}

/// Older sessions have none of these, or the first.
constexpr std::array kLaterColumns{"sync_residual_mm", "stamp_sigma_ns"};

std::vector<std::string> frames_columns(std::size_t later = kLaterColumns.size()) {
  std::vector<std::string> columns{"camera",      "index", "sequence", "stamp_ns",
                                   "exposure_ns", "phase", "pass",     "laser_on"};
  add_joint_columns(columns, "q_", "_rad");
  columns.emplace_back("sync_residual_ns");
  columns.insert(columns.end(), kLaterColumns.begin(), kLaterColumns.begin() + later);
  for (const char* c : {"plane_a", "plane_b", "plane_c", "plane_d_m", "file"}) columns.emplace_back(c);
  return columns;
}

std::vector<std::string> events_columns() { return {"stamp_ns", "kind", "text"}; }

std::string csv_line(const std::vector<std::string>& fields) { return fmt::format("{}\n", fmt::join(fields, ",")); }

/// The fields of one row, taken in order.
struct Fields {
  const CsvTable& table;
  const CsvRow& row;
  std::size_t next = 0;

  const std::string& text() { return row.fields[next++]; }
  bool empty() const { return row.fields[next].empty(); }

  template <class T>
  T number(const char* expected) {
    T value{};
    if (!parse_number(row.fields[next], value)) table.fail(row, next, expected);
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value)) table.fail(row, next, expected);
    ++next;
    return value;
  }
  double real() { return number<double>("a number"); }
  std::int64_t whole() { return number<std::int64_t>("a whole number"); }
  std::int64_t count() {
    const std::int64_t value = whole();
    if (value < 0 || value > 0x7fffffff) table.fail(row, next - 1, "a whole number of at least 0");
    return value;
  }
  JointVector joints() {
    JointVector q;
    for (int i = 0; i < kJoints; ++i) q[i] = real();
    return q;
  }
};

template <class Record, class Parse>
SessionTable<Record> read_table(const std::filesystem::path& file, const std::vector<std::string>& columns,
                                bool recording, Parse parse) {
  const CsvTable table = read_csv(file, columns, recording);
  SessionTable<Record> out;
  out.cut_short = table.cut_short;
  out.records.reserve(table.rows.size());
  for (const CsvRow& row : table.rows) out.records.push_back(parse(Fields{table, row}));
  return out;
}

/// Of a length [m], in millimetres; reads back and writes again to the same text.
std::string tenths_of_microns(double length) { return fmt::format("{:.4f}", 1e3 * length); }

FrameRecord parse_frame(Fields fields) {
  FrameRecord frame;
  frame.camera = fields.text();
  if (!is_camera_name(frame.camera)) fields.table.fail(fields.row, 0, "a camera's name");
  frame.index = static_cast<int>(fields.count());
  frame.sequence = fields.number<std::uint64_t>("a whole number of at least 0");
  frame.stamp.ns = fields.whole();
  frame.exposure = Duration{fields.whole()};
  const std::string& phase = fields.text();
  bool known = false;
  for (const Phase p : kPhases)
    if (phase == to_string(p)) frame.phase = p, known = true;
  if (!known) fields.table.fail(fields.row, fields.next - 1, "move, dark_before, sweep or dark_after");
  frame.pass = static_cast<int>(fields.count());
  const std::string& laser = fields.text();
  if (laser != "0" && laser != "1") fields.table.fail(fields.row, fields.next - 1, "0 or 1");
  frame.laser_on = laser == "1";
  if (fields.empty())
    fields.next += kJoints;
  else
    frame.q = fields.joints();
  frame.sync_residual = Duration{fields.whole()};
  if (fields.table.columns[fields.next] == kLaterColumns[0]) frame.sync_on_target = 1e-3 * fields.real();
  if (fields.table.columns[fields.next] == kLaterColumns[1]) frame.stamp_sigma = Duration{fields.whole()};
  if (fields.empty()) {
    fields.next += 4;
  } else {
    const double a = fields.real(), b = fields.real(), c = fields.real(), d = fields.real();
    frame.cPl = Plane{{a, b, c}, d};
    if (!(std::abs(frame.cPl->normal.norm() - 1) < 1e-6))
      fields.table.fail(fields.row, fields.next - 4, "the first number of a normal of length 1");
    if (!plausible_length(d))
      fields.table.fail(fields.row, fields.next - 1, "metres, at most a tank's length (20); looks like millimetres");
  }
  frame.file = fields.text();
  if (!is_picture_name(frame.file, frame.camera))
    fields.table.fail(fields.row, fields.next - 1, "a picture below frames/" + shown_text(frame.camera) + "/");
  return frame;
}

JointState parse_joints(Fields fields) {
  JointState state;
  state.stamp.ns = fields.whole();
  state.q = fields.joints();
  state.velocity = fields.joints();
  for (std::int32_t& ticks : state.ticks) ticks = fields.number<std::int32_t>("a whole number of 32 bits");
  state.current_a = fields.real();
  return state;
}

SessionEvent parse_event(Fields fields) {
  SessionEvent event;
  event.stamp.ns = fields.whole();
  event.kind = fields.text();
  event.text = fields.text();
  return event;
}

template <class Parse>
auto parse_line(std::string_view line, const std::vector<std::string>& columns, Parse parse)
    -> std::optional<decltype(parse(std::declval<Fields>()))> {
  if (line.ends_with('\n')) line.remove_suffix(1);
  const CsvTable table{{}, columns, {{0, split_csv_line(line)}}};
  if (table.rows[0].fields.size() != columns.size()) return std::nullopt;
  try {
    return parse(Fields{table, table.rows[0]});
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

std::string joints_header() { return csv_line(joints_columns()); }
std::string frames_header() { return csv_line(frames_columns()); }
std::string events_header() { return csv_line(events_columns()); }

std::string joints_line(const JointState& state) {
  std::vector<std::string> fields{std::to_string(state.stamp.ns)};
  for (const double q : state.q) fields.push_back(exact_text(q));
  for (const double v : state.velocity) fields.push_back(exact_text(v));
  for (const std::int32_t ticks : state.ticks) fields.push_back(std::to_string(ticks));
  fields.push_back(exact_text(state.current_a));
  return csv_line(fields);
}

std::string frames_line(const FrameRecord& frame) {
  std::vector<std::string> fields{csv_field(frame.camera),
                                  std::to_string(frame.index),
                                  std::to_string(frame.sequence),
                                  std::to_string(frame.stamp.ns),
                                  std::to_string(frame.exposure.count()),
                                  to_string(frame.phase),
                                  std::to_string(frame.pass),
                                  frame.laser_on ? "1" : "0"};
  for (int i = 0; i < kJoints; ++i) fields.push_back(frame.q ? exact_text((*frame.q)[i]) : "");
  fields.push_back(std::to_string(frame.sync_residual.count()));
  fields.push_back(tenths_of_microns(frame.sync_on_target));
  fields.push_back(std::to_string(frame.stamp_sigma.count()));
  for (int i = 0; i < 3; ++i) fields.push_back(frame.cPl ? exact_text(frame.cPl->normal[i]) : "");
  fields.push_back(frame.cPl ? exact_text(frame.cPl->offset) : "");
  fields.push_back(csv_field(frame.file));
  return csv_line(fields);
}

std::string events_line(Stamp stamp, std::string_view kind, std::string_view text) {
  return csv_line({std::to_string(stamp.ns), csv_field(kind), csv_field(text)});
}

std::optional<JointState> parse_joints_line(std::string_view line) {
  return parse_line(line, joints_columns(), parse_joints);
}

std::optional<FrameRecord> parse_frames_line(std::string_view line) {
  for (std::size_t later = kLaterColumns.size(); later > 0; --later)
    if (auto frame = parse_line(line, frames_columns(later), parse_frame)) return frame;
  return parse_line(line, frames_columns(0), parse_frame);
}

std::string picture_name(const FrameRecord& frame) {
  return fmt::format("frames/{}/{:06}.png", frame.camera, frame.index);
}

FrameRecord as_recorded(FrameRecord frame) {
  if (frame.file.empty()) frame.file = picture_name(frame);
  const std::string line = frames_line(frame);
  if (auto read = parse_frames_line(line)) return *std::move(read);
  throw InputError("frames.csv: found the line '" + shown_text(line) + "', expected one that can be read back");
}

std::optional<SessionEvent> parse_events_line(std::string_view line) {
  return parse_line(line, events_columns(), parse_event);
}

SessionTable<JointState> read_joints_csv(const std::filesystem::path& file, bool recording) {
  return read_table<JointState>(file, joints_columns(), recording, parse_joints);
}

SessionTable<FrameRecord> read_frames_csv(const std::filesystem::path& file, bool recording) {
  const std::string text = read_whole_file(file);
  std::size_t later = 0;
  while (later < kLaterColumns.size() && !text.starts_with(csv_line(frames_columns(later)))) ++later;
  return read_table<FrameRecord>(file, frames_columns(later), recording, parse_frame);
}

SessionTable<SessionEvent> read_events_csv(const std::filesystem::path& file, bool recording) {
  return read_table<SessionEvent>(file, events_columns(), recording, parse_event);
}

}  // namespace tankrig
