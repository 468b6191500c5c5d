// A whole session out of a damaged or killed one.
#pragma once

#include <optional>

#include "session/checking/session_findings.hpp"
#include "session/recording/spool_pictures.hpp"

namespace tankrig {

struct RecoverOptions {
  std::filesystem::path out;  ///< mend a copy, made here and kept if it is finished; empty: in place
  DescribeRig describe;
  PictureOptions pictures;
};

struct Recovery {
  std::filesystem::path session;  ///< the mended one, or the source where no copy is left
  SessionFindings found;          ///< before
  bool finished = true;           ///< false: stopped while writing pictures, or nothing usable
};

/// Mends `session` so that examine_session() finds it whole: frames of the spool become pictures, torn lines, frames
/// without pictures and pictures without lines are left out, session.yaml says what was lost (`recovered`) and how many
/// lines there are now, SHA256SUMS is made anew. Every file that is replaced or left out is kept below lost+found/N/.
/// Changes nothing in a whole session, or one with nothing usable. What it calls finished is on the disk. May be killed
/// anywhere and run again.
/// Errors: InputError naming the file; also if another process writes to the session, `out` lies in it, or what was
/// mended cannot be opened: then it is not sealed.
Recovery recover_session(const std::filesystem::path& session, const RecoverOptions& options);

}  // namespace tankrig
