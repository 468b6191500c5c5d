// A cloud that somebody's program makes of a session: docs/reference/algorithms.md is its contract.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>

#include "apps/tankrig/bench/measured_scan.hpp"
#include "bench/benchmark/benchmark.hpp"
#include "pipeline/reconstruct_session.hpp"

namespace tankrig::app {

/// The command below `tankrig bench` that supervises a program.
inline constexpr const char* kProgramCommand = "program";

/// The executable file that <program> names: below `folder`, or, without a slash, in PATH. None: there is none.
std::optional<std::filesystem::path> program_file(const std::filesystem::path& named,
                                                  const std::filesystem::path& folder);

/// Runs the program on a copy of the session: the pictures of its cameras, without the object. What goes wrong with it,
/// or with its cloud, is the `reason` of an empty cloud. Points outside `workspace` are left out, as of our clouds.
/// Threads: any.
/// Errors: InputError if this machine cannot write the session or start a process.
Reconstruction external_reconstruction(const Algorithm& algorithm, const MeasuredScan& scan, const Session& session,
                                       const std::optional<WorkspaceBox>& workspace, const std::atomic<bool>& stop);

}  // namespace tankrig::app
