// What can be read of the tables and the spool.
#include <fmt/core.h>

#include "session/checking/examination.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

bool of_this_session(const Examination& so_far, const FrameRecord& frame) {
  return so_far.info.cameras.empty() || so_far.info.has_camera(frame.camera);
}

std::optional<FrameRecord> frame_from(const Examination& so_far, const std::string& line) {
  auto frame = parse_frames_line(line);
  return frame && of_this_session(so_far, *frame) ? std::move(frame) : std::nullopt;
}

template <class Table>
void tell_table(Examination& so_far, const std::string& file, const Table& table) {
  if (!table.damaged) return;
  if (table.missing)
    so_far.lose(file, "missing");
  else if (table.bad_lines > 0)
    so_far.lose(file, fmt::format("{} cannot be read and {} left out", plural(table.bad_lines, "line"),
                                  table.bad_lines == 1 ? "is" : "are"));
  else
    so_far.lose(file, "its header is damaged");
}

void read_segment(Examination& so_far, const fs::path& file, std::set<std::string>& known) {
  const SpoolSegment segment(file);
  std::size_t strange = 0;
  for (const SpooledFrame& spooled : segment.frames()) {
    auto frame = frame_from(so_far, spooled.line);
    if (!frame || !so_far.in_spool.insert(frame->file).second) {
      ++strange;
      continue;
    }
    if (!known.insert(frame->file).second) continue;
    const bool as_written_now = so_far.frames.text.starts_with(frames_header());
    so_far.frames.text += as_written_now ? frames_line(*frame) : spooled.line;
    so_far.frames.records.push_back(std::move(*frame));
    so_far.frames.damaged = true;
  }
  const fs::path name = fs::path("spool") / file.filename();
  if (segment.stray_bytes() > 0)
    so_far.lose(name, fmt::format("{} bytes are of no whole frame", segment.stray_bytes()));
  if (strange > 0) so_far.lose(name, plural(strange, "frame") + " without a proper line of its own");
}

}  // namespace

void examine_tables(Examination& so_far) {
  so_far.joints = salvage_table<JointState>(so_far.session / "joints.csv", joints_header(), read_joints_csv,
                                            parse_joints_line, joints_line);
  so_far.events =
      salvage_table<SessionEvent>(so_far.session / "events.csv", events_header(), read_events_csv, parse_events_line,
                                  [](const SessionEvent& e) { return events_line(e.stamp, e.kind, e.text); });
  so_far.frames = salvage_table<FrameRecord>(
      so_far.session / "frames.csv", frames_header(),
      [&](const fs::path& file, bool recording) {
        auto table = read_frames_csv(file, recording);
        for (const FrameRecord& frame : table.records)
          if (!of_this_session(so_far, frame)) throw InputError(file, "a frame of no camera of session.yaml");
        return table;
      },
      [&](const std::string& line) { return frame_from(so_far, line); }, frames_line);
  tell_table(so_far, "joints.csv", so_far.joints);
  tell_table(so_far, "events.csv", so_far.events);
  tell_table(so_far, "frames.csv", so_far.frames);
}

void examine_spool(Examination& so_far) {
  std::set<std::string> known;
  for (const FrameRecord& frame : so_far.frames.records) known.insert(frame.file);
  for (const fs::path& file : spool_segments(so_far.session)) try {
      read_segment(so_far, file, known);
    } catch (const InputError& e) {
      so_far.set_aside.insert(file.lexically_relative(so_far.session).generic_string());
      so_far.lose(fs::path("spool") / file.filename(), "cannot be read (" + within(so_far.session, e.what()) + ")");
    }
  so_far.spooled = so_far.in_spool.size();
  if (so_far.spooled > 0)
    so_far.undone.push_back(fmt::format("spool: {} not made into pictures yet", plural(so_far.spooled, "frame")));
}

void compare_lengths(Examination& so_far) {
  const auto compare = [&](const char* table, std::size_t found, Stamp last) {
    std::string text = lines_missing(so_far.info, table, found);
    if (text.empty()) return;
    const TableSpan& span = so_far.info.tables.at(table);
    if (found == 0)
      text += ", all lost " + so_far.span_text(span.first, span.last);
    else if (last < span.last)
      text += ", the end lost " + so_far.span_text(last, span.last);
    so_far.told.insert(std::string(table) + ".csv");
    so_far.losses.push_back(text);
  };
  const auto last = [](const auto& table) { return table.records.empty() ? Stamp{} : table.records.back().stamp; };
  compare("joints", so_far.joints.records.size(), last(so_far.joints));
  compare("events", so_far.events.records.size(), last(so_far.events));
  compare("frames", so_far.frame_lines, last(so_far.frames));
  if (so_far.info.tables.empty() && so_far.info.status == "recording" && !so_far.joints.records.empty())
    so_far.lose("joints.csv", "ends " + seconds_text(last(so_far.joints) - so_far.zero()) +
                                  " after its first line; what came later is lost");
}

}  // namespace tankrig
