// How examine_session() goes about it: what is known so far, and the steps that find out more, in their order.
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

/// session.yaml, and where it is cut or lost, what of it can still be read, and the rest from the session's rig file:
/// info, calibration, info_known and info_damaged. A calibration from rig.yaml is taken for the recorded one if it has
/// its SHA-256, or is to the letter the one that session.yaml holds beside a damaged SHA-256.
void examine_session_yaml(Examination& so_far, const DescribeRig& describe);

/// Which files are not as they were sealed.
void read_seal(Examination& so_far);

/// The lines of the tables, and the frames of the spool; those that frames.csv had no time for join its lines.
void examine_tables(Examination& so_far);
void examine_spool(Examination& so_far);

/// Leaves out frames without a whole picture; pictures of no line, and files that were never finished, are set aside.
void examine_pictures(Examination& so_far);

/// Against what session.yaml says was recorded.
void compare_lengths(Examination& so_far);

/// What the seal, and session.yaml where there is none, say of the files nobody spoke of yet.
void compare_rest(Examination& so_far);

/// "1 frame", "2 frames".
std::string plural(std::size_t n, const std::string& what);
std::string seconds_text(Duration time);

/// `message` of an error without the session's own path before it.
std::string within(const std::filesystem::path& session, const std::string& message);

}  // namespace tankrig
