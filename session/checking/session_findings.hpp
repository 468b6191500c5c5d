// What is left of a session, file by file: `session check` reports it, `session recover` mends it.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "session/checking/salvage_table.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// Cameras, calibration and object from the session's copy of the rig file, if session.yaml is lost. The caller passes
/// this in, because only rig/config knows rig files.
/// Errors: InputError.
using DescribeRig = std::function<void(const std::filesystem::path& rig_yaml, SessionInfo& info)>;

struct SessionFindings {
  SessionInfo info;           ///< of session.yaml, or as much as can be made of it and rig.yaml
  std::string calibration;    ///< cameras, calibration and object to the letter, as session.yaml is to have them
  bool info_known = false;    ///< cameras and calibration are
  bool info_damaged = false;  ///< session.yaml is not as it was written
  SalvagedTable<JointState> joints;
  SalvagedTable<SessionEvent> events;
  SalvagedTable<FrameRecord> frames;  ///< of frames.csv and of the spool, that have a picture or are in the spool whole
  std::size_t spooled = 0;            ///< of these, still in the spool
  bool sealed = false;                ///< there is a SHA256SUMS, whatever it says
  std::set<std::string> set_aside;    ///< files that `recover` moves to lost+found: damaged, or of nothing
  std::vector<std::string> losses;    ///< one in plain words, each beginning with the file or camera it concerns
  std::vector<std::string>
      undone;                      ///< nothing lost, but not finished: frames in the spool, no seal, clouds without one
  std::vector<std::string> extra;  ///< files that are not of the recording

  bool whole() const { return losses.empty() && undone.empty() && extra.empty(); }
  /// What a usable session needs and this one lacks: a frame or a joint sample, and its cameras.
  std::vector<std::string> missing() const;
  bool usable() const { return missing().empty(); }
};

/// Reads every byte of a session and changes none.
/// Errors: InputError if it is no folder, or contains a link.
SessionFindings examine_session(const std::filesystem::path& session, const DescribeRig& describe);

}  // namespace tankrig
