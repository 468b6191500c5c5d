// Recordings of one piece of work, each in a folder of its own: the work can go on where it was stopped.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/scan/ready_rig.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// The session at `path`: as it is if it is complete, else recorded now, without clouds and report. `before()` comes
/// first then, and may change how it is recorded. One that was stopped is put aside.
/// Errors: InputError, also if what is there is of another rig, or if the recording is stopped or frames of it are missing;
/// StoppedEarly.
OpenedSession recorded_session(ScanOptions options, const RigConfig& rig, const std::filesystem::path& path,
                               const ReadyRig::PlanFrom& plan_from, Progress& progress,
                               const std::function<void(ScanOptions&)>& before);

/// The session at `path` however it ended, if its pictures can be read.
/// Errors: InputError if it is of another rig.
std::optional<OpenedSession> session_so_far(const std::filesystem::path& path, const RigConfig& rig,
                                            const sim::WorldOptions& world, Progress& progress);

/// Renames a session to PATH.`why`, or PATH.`why`-2 ..., and says so.
void put_aside(const std::filesystem::path& path, const std::string& why, Progress& progress);

}  // namespace tankrig::app
