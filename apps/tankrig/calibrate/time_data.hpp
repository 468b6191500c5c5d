// What `calibrate time` computes an offset from: stripes and joints of recorded sweeps.
#pragma once

#include <filesystem>
#include <vector>

#include "apps/tankrig/command_line/progress.hpp"
#include "calibration/time_offset/time_offset.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// Laser on, arm sweeping, joints known.
bool lit_sweep(const FrameRecord& frame);

/// The recorded readings.
/// Errors: InputError if there are fewer than two.
std::vector<TimedJoints> timed_joints(const OpenedSession& opened);

/// Tables and lit frames of the sessions.
std::vector<std::filesystem::path> recorded_files(const std::vector<OpenedSession>& sessions);

/// Stripes as the laser method finds them, and the joints beside them.
/// Errors: InputError: a session without passes there and back, without arm, or of another calibration than the first.
TimeOffsetProblem time_problem(const std::vector<OpenedSession>& sessions, Progress& progress);

}  // namespace tankrig::app
