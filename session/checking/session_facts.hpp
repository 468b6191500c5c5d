// session.yaml when it is cut or lost: what of it can still be read, and the rest from the session's rig file.
#pragma once

#include "session/checking/session_findings.hpp"

namespace tankrig {

/// Fills in info, calibration, info_known and info_damaged, and says in `losses` what is not as it was recorded. A
/// calibration from rig.yaml is taken for the recorded one if it has its SHA-256, or is to the letter the one that
/// session.yaml holds beside a damaged SHA-256.
void examine_session_yaml(const std::filesystem::path& session, const DescribeRig& describe, SessionFindings& findings);

/// `message` of an error without the session's own path before it.
std::string within(const std::filesystem::path& session, const std::string& message);

}  // namespace tankrig
