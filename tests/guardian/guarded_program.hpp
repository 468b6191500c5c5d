// A program that lights and moves emulated devices under a guardian, for tests that end it in every way there is.
#pragma once

#include <filesystem>
#include <string>

#include "rig/guardian/guardian.hpp"

namespace tankrig::testing_support {

inline constexpr int kObjected = 5;  ///< its exit code when it finds that it is not guarded any more

/// The devices of both, below `folder`; `carrier`: "can" or "serial".
GuardianSettings guarded_devices(const std::filesystem::path& folder, const std::string& carrier);

/// Lights the laser and drives the elbow to and fro at 200 Hz until SIGTERM; then an orderly end.
int run_guarded_program(const std::filesystem::path& folder, const std::string& carrier);

}  // namespace tankrig::testing_support
