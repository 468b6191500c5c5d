// Makes a damaged or killed session whole.
#pragma once

#include <optional>

#include "session/checking/session_findings.hpp"
#include "session/recording/spool_pictures.hpp"

namespace tankrig {

struct RecoverOptions {
  std::filesystem::path out;  ///< mend a copy, made here and kept if finished; empty: in place
  DescribeRig describe;
  PictureOptions pictures;
};

struct Recovery {
  std::filesystem::path session;  ///< the mended one; the source if no copy is left
  SessionFindings found;          ///< before
  bool finished = true;           ///< false: stopped while writing pictures, or nothing usable
};

/// Mends `session` so that examine_session() finds it whole. Frames of the spool become pictures. Torn lines, frames
/// without pictures and pictures without lines are left out. session.yaml gets the losses (`recovered`) and the new
/// number of lines; SHA256SUMS is made anew.
/// Replaced and left-out files are kept below lost+found/N/. A session that is whole, or has nothing usable, is not
/// changed. A finished one is on the disk. May be killed anywhere and run again.
/// Errors: InputError naming the file; also if another process writes to the session, if `out` lies in it, or if the
/// mended session cannot be opened: then it is not sealed.
Recovery recover_session(const std::filesystem::path& session, const RecoverOptions& options);

}  // namespace tankrig
