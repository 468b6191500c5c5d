// The tables of a session, record by record: joints.csv, frames.csv, events.csv.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/joint_state.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// A line of events.csv.
struct SessionEvent {
  Stamp stamp{};
  std::string kind, text;
};

std::string joints_header();
std::string frames_header();
std::string events_header();
std::string joints_line(const JointState& state);
std::string frames_line(const FrameRecord& frame);
std::string events_line(Stamp stamp, std::string_view kind, std::string_view text);

/// frames/<camera>/<index>.png
std::string picture_name(const FrameRecord& frame);

/// The record as frames.csv will give it back: its numbers as text has them, an empty `file` named by picture_name().
FrameRecord as_recorded(FrameRecord frame);

/// One line, with or without its line end; nothing if it is incomplete or malformed.
std::optional<JointState> parse_joints_line(std::string_view line);
std::optional<FrameRecord> parse_frames_line(std::string_view line);
std::optional<SessionEvent> parse_events_line(std::string_view line);

/// A table read back. `cut_short`: its last line was incomplete and is left out.
template <class Record>
struct SessionTable {
  std::vector<Record> records;
  bool cut_short = false;
};

/// A table with an incomplete header is refused, except while `recording`: then it counts as empty and cut short.
/// Errors: InputError with file, line and column.
SessionTable<JointState> read_joints_csv(const std::filesystem::path& file, bool recording = false);
SessionTable<FrameRecord> read_frames_csv(const std::filesystem::path& file, bool recording = false);
SessionTable<SessionEvent> read_events_csv(const std::filesystem::path& file, bool recording = false);

}  // namespace tankrig
