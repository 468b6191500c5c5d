// A session as flat tables for plotting: seconds since its start, poses spelled out, units in every column's name.
#pragma once

#include <string>

#include "session/export/wall_clock.hpp"
#include "session/reading/session.hpp"
#include "session/reading/session_tables.hpp"

namespace tankrig {

/// Columns: docs/reference/export.md. `start`: where time_s is 0. Unknown values are empty fields.
std::string flat_joints_csv(const std::vector<JointState>& joints, Stamp start, const WallClock& clock);
/// With bMe, the end effector in the arm base, for every frame with known joints and arm.
std::string flat_frames_csv(const Session& session, Stamp start, const WallClock& clock);
std::string flat_events_csv(const std::vector<SessionEvent>& events, Stamp start, const WallClock& clock);

}  // namespace tankrig
