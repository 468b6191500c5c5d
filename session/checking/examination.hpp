// The steps of examine_session(), in their order, and what they have found so far.
#pragma once

#include <map>
#include <set>
#include <string>

#include "session/checking/checksums.hpp"
#include "session/checking/session_findings.hpp"

namespace tankrig {

struct Examination : SessionFindings {
  std::filesystem::path session;
  std::set<std::string> told;                                   ///< files whose damage is in the losses already
  std::map<std::string, ChecksumDifference::Kind> unlike_seal;  ///< files that are not as the seal says
  bool seal_read = false;
  std::set<std::string> in_spool;  ///< pictures that frames of the spool will become
  std::size_t frame_lines = 0;     ///< with a picture or without

  void lose(const std::filesystem::path& file, const std::string& what);
  /// "from 0.100 s to 2.300 s", since the first joint sample, or frame.
  std::string span_text(Stamp from, Stamp to) const;
  Stamp zero() const;
};

/// Reads session.yaml: info, calibration, info_known and info_damaged. If it is cut or lost, the rest comes from the
/// session's rig file. A calibration from rig.yaml counts as the recorded one if its SHA-256 matches, or if it equals,
/// to the letter, the one in session.yaml beside a damaged SHA-256.
void examine_session_yaml(Examination& so_far, const DescribeRig& describe);

/// Finds the files that differ from the seal.
void read_seal(Examination& so_far);

/// Reads the lines of the tables and the frames of the spool. Frames not yet in frames.csv are added to its lines.
void examine_tables(Examination& so_far);
void examine_spool(Examination& so_far);

/// Leaves out frames without a whole picture. Sets aside pictures without a line and unfinished files.
void examine_pictures(Examination& so_far);

/// Compares with the lengths in session.yaml.
void compare_lengths(Examination& so_far);

/// Compares the files not examined yet with the seal or, if there is none, with session.yaml.
void compare_rest(Examination& so_far);

/// "1 frame", "2 frames".
std::string plural(std::size_t n, const std::string& what);
std::string seconds_text(Duration time);

/// An error's `message` without the leading path of the session.
std::string within(const std::filesystem::path& session, const std::string& message);

}  // namespace tankrig
