// A cloud that somebody's program makes of a session: docs/reference/algorithms.md is its contract.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/benchmark/benchmark.hpp"
#include "core/joint_state.hpp"
#include "pipeline/reconstruct_session.hpp"

namespace tankrig::app {

/// The command below `tankrig bench` that supervises a program.
inline constexpr const char* kProgramCommand = "program";

/// The executable file that <program> names: below `folder`, or, without a slash, in PATH. None: there is none.
std::optional<std::filesystem::path> program_file(const std::filesystem::path& named,
                                                  const std::filesystem::path& folder);

/// What a program gets of a session: the cameras that it uses with their pictures, the arm and the laser; no object.
struct GivenSession {
  const Session& session;
  const std::vector<JointState>& joints;
  const std::string& rig_yaml;
};

/// Writes it to `folder`. `laser`, `stereo`: whose cameras.
/// Errors: InputError.
void write_given_session(const std::filesystem::path& folder, const GivenSession& given, bool laser, bool stereo);

/// Of a program that runs in the sandbox.
struct Stranger {
  std::filesystem::path folder;  ///< where it lies; open to others
  std::filesystem::path log;     ///< where what it prints is kept
};

/// The cloud of a file in b, as an algorithm may leave one.
/// Errors: InputError if it is none, is in another frame, has too many points, or none that is finite.
PointCloud cloud_from_others(const std::filesystem::path& file);

/// Runs the program on a copy of the session. What goes wrong with it, or with its cloud, is the `reason` of an empty
/// cloud. Points outside `workspace` are left out, as of our clouds.
/// Threads: any.
/// Errors: InputError if this machine cannot write the session or start a process.
Reconstruction external_reconstruction(const Algorithm& algorithm, const GivenSession& given,
                                       const std::optional<WorkspaceBox>& workspace, const std::atomic<bool>& stop,
                                       const std::optional<Stranger>& stranger = {});

}  // namespace tankrig::app
