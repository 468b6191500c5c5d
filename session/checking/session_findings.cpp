#include "session/checking/session_findings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "session/checking/examination.hpp"
#include "session/reading/session_folder.hpp"

namespace tankrig {
namespace {

/// Frames of which nobody knows are a fault of the recording. Told no second time of a session that was recovered.
void compare_accounts(Examination& so_far) {
  const auto& recovered = so_far.info.recovered;
  for (const auto& [camera, account] : so_far.info.account) {
    if (account.closes()) continue;
    const std::string loss =
        fmt::format("camera {}: of {} frames {} are {}", camera, account.expected, std::abs(account.unaccounted),
                    account.unaccounted > 0 ? "neither recorded nor left out for a reason" : "counted twice");
    if (std::find(recovered.begin(), recovered.end(), loss) == recovered.end()) so_far.losses.push_back(loss);
  }
}

}  // namespace

std::vector<std::string> SessionFindings::missing() const {
  std::vector<std::string> out;
  if (!info_known) out.emplace_back("cameras and calibration, which neither session.yaml nor rig.yaml tells");
  if (frames.records.empty() && joints.records.empty())
    out.emplace_back("a frame with its picture, or a joint sample: there is none");
  return out;
}

SessionFindings examine_session(const std::filesystem::path& session, const DescribeRig& describe) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(session, ignored))
    throw InputError(session, "is not a folder, expected a session");
  refuse_links(session);
  Examination so_far;
  so_far.session = session;
  examine_session_yaml(so_far, describe);
  read_seal(so_far);
  examine_tables(so_far);
  examine_spool(so_far);
  examine_pictures(so_far);
  compare_lengths(so_far);
  compare_accounts(so_far);
  compare_rest(so_far);
  return so_far;
}

}  // namespace tankrig
